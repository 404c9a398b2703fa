"""The scale of a photo: markers, the sample's face, a ruler, and the view of the camera."""
