"""Read a scan of a sample's face, and bring it into the frame of the sample.

``points_file`` reads points in mm. ``registration`` finds the position of the scan, by named points or by the face's
plane and the crack's mouth, and judges it on the uncracked face. ``height_map`` has heights in square cells.
"""
