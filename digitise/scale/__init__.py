"""The scale of a photo, from markers, the sample's face or a ruler, and the view of the camera."""
