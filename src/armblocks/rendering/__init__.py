"""Pictures of arms: their meshes, projected by a camera and rasterised."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.rendering.arm_drawing import arm_picture, arm_picture_svg, pose_sequence_picture
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "arm_picture": "armblocks.rendering.arm_drawing",
            "arm_picture_svg": "armblocks.rendering.arm_drawing",
            "pose_sequence_picture": "armblocks.rendering.arm_drawing",
        },
    )

__all__ = [
    "arm_picture",
    "arm_picture_svg",
    "pose_sequence_picture",
]
