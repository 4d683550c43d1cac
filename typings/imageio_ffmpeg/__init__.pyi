"""The part of imageio-ffmpeg that armblocks uses; the library has no types."""

from collections.abc import Generator, Sequence

def write_frames(
    path: str,
    size: tuple[int, int],
    *,
    fps: float = ...,
    codec: str = ...,
    macro_block_size: int = ...,
    ffmpeg_log_level: str = ...,
    output_params: Sequence[str] = ...,
) -> Generator[None, bytes | None]: ...
