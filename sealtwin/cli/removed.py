"""Options of version 0.2 that went, and what is given in their place."""

_PHOTO = {
    "--assumed": "--set photo.scale_is=assumed",
    "--data": "--set photo.data=ORIGIN",
    "--face-corners": "--set photo.face_corners_px=[[X,Y],[X,Y],[X,Y],[X,Y]]",
    "--ruler": "--set photo.ruler_px=[[X,Y],[X,Y]]",
    "--ruler-mm": "--set photo.ruler_mm=NUMBER",
    "--crack": "--set photo.crack=NUMBER",
    "--second-photo": "--set photo.second_photo=PHOTO",
    "--path-only": "--set photo.path_only=true",
    "--edge-fraction": "--set photo.edge_fraction=NUMBER",
    "--keep-branches": "--set photo.branches=keep",
    "--tilt": "--set crack.tilt=TILT",
    "--wall-angle-deg": "--set crack.wall_angle_deg=DEG, or [LEFT,RIGHT]",
    "--volume-ml": "--set path.volume_ml=NUMBER",
}
_MESH = {
    "--data": "--set mesh.data=ORIGIN",
    "--up": "--set mesh.up=AXIS",
    "--path": "--set mesh.path=FILE",
    "--base-mm": "--set mesh.base_mm=NUMBER",
    "--dam-height-mm": "--set mesh.dam_height_mm=NUMBER",
    "--volume-ml": "--set path.volume_ml=NUMBER",
}
_FRAMES = {"--frames-every-s": "--set output.frames_every_s=NUMBER"}
REMOVED = {
    "digitise": _PHOTO,
    "quick": {"--assumed": _PHOTO["--assumed"]},
    "import-mesh": _MESH,
    "import-dxf": {"--data": _MESH["--data"]},
    "run": _FRAMES,
    "simulate": _FRAMES,
}
"""The new spelling of each option that a command had."""
