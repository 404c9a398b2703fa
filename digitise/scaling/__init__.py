"""Where pixels lie on the face, and how well that is known."""
