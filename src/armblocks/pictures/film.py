"""Videos: frames of equal size, encoded as GIF (by Pillow) or as MP4 (by ffmpeg).

A video is written frame by frame to a temporary file, which is renamed when the video is complete. Only a few
frames are in memory. After an error or Ctrl-C, an existing file of that name is unchanged.
"""

from __future__ import annotations

import contextlib
import importlib
import struct
from collections.abc import Callable, Generator
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import FormatError, InputError, UnknownNameError
from armblocks.extras import from_extra
from armblocks.files import GrowingFile

if TYPE_CHECKING:
    from PIL.Image import Image

Pixels: TypeAlias = NDArray[np.uint8]
"""An opaque image: (rows, columns, 3)."""
FilmProgress: TypeAlias = Callable[[int, int], object]
"""Called with the number of written frames, and of all frames."""

FILM_SUFFIXES = (".gif", ".mp4")
MAX_FRAMES = {".gif": 1500, ".mp4": 15_000}
"""Maximum number of frames by suffix: a GIF of 1500 frames has tens of megabytes."""
MAX_SIDE = 3840
"""Maximum width and height, pixels."""
GIF_CENTISECONDS = 100
"""The unit of the durations of GIF, per second."""
_BACKGROUND = 255
"""The index of the background in the table of colours of a GIF."""
_PALETTE_SAMPLES = 5
"""Frames from which the colours of a GIF are chosen."""


def film_suffix(path: str | Path) -> str:
    """The suffix of a video in lower case. Raises ``UnknownNameError`` for other suffixes."""
    suffix = Path(path).suffix.lower()
    if suffix not in FILM_SUFFIXES:
        raise UnknownNameError("format of videos", suffix, FILM_SUFFIXES, where=str(path))
    return suffix


def exact_rate(path: str | Path, rate: float) -> float:
    """The nearest frame rate that the format supports: GIF frames last whole hundredths of a second."""
    if film_suffix(path) == ".gif":
        return GIF_CENTISECONDS / max(2, round(GIF_CENTISECONDS / rate))
    return rate


def check_film(path: str | Path, count: int, size: tuple[int, int]) -> None:
    """Check the libraries, number of frames and size (width, height) in pixels before the first frame.

    Raises ``MissingLibraryError``, ``InputError``, and ``UnknownNameError`` for an unsupported suffix.
    """
    suffix = film_suffix(path)
    with from_extra("film", f"{suffix[1:].upper()} videos"):
        importlib.import_module("PIL.Image" if suffix == ".gif" else "imageio_ffmpeg")
    if count > MAX_FRAMES[suffix]:
        raise InputError(
            f"the video has {count} frames",
            where=str(path),
            allowed=f"at most {MAX_FRAMES[suffix]} frames in {suffix} files",
            fix="give a lower rate=, a higher speed=, or write an .mp4 file"
            if suffix == ".gif"
            else "give a lower rate= or a higher speed=",
        )
    if not all(2 <= side <= MAX_SIDE for side in size):
        raise InputError(
            f"the frames have {size[0]} x {size[1]} pixels",
            where=str(path),
            allowed=f"2 to {MAX_SIDE} pixels on each side",
            fix="give another size=",
        )


def write_film(
    path: str | Path,
    frame: Callable[[int], Pixels],
    count: int,
    rate: float,
    progress: FilmProgress | None = None,
) -> Path:
    """Write a video of the frames ``frame(0)`` to ``frame(count - 1)`` with ``rate`` frames per second.

    The suffix ``.gif`` or ``.mp4`` selects the format. H.264 requires even sizes: if the size of MP4 frames
    is odd, a row or column is removed. Raises as :func:`check_film`, and ``FormatError`` if the file cannot
    be written.
    """
    first = frame(0)
    suffix = film_suffix(path)
    if suffix == ".mp4":
        first = _even(first)
    check_film(path, count, (first.shape[1], first.shape[0]))
    growing = GrowingFile(path)
    writer = _gif(growing, frame, count, rate) if suffix == ".gif" else _mp4(growing, first, rate)
    try:
        next(writer)
        for k in range(count):
            pixels = first if k == 0 else frame(k)
            writer.send(pixels if suffix == ".gif" else _even(pixels))
            if progress is not None:
                progress(k + 1, count)
        writer.close()
    except BaseException:
        with contextlib.suppress(FormatError):
            writer.close()  # ends ffmpeg
        growing.abandon()
        raise
    growing.finish()
    return Path(path)


def _even(pixels: Pixels) -> Pixels:
    rows, columns, _ = pixels.shape
    return np.ascontiguousarray(pixels[: rows - rows % 2, : columns - columns % 2])


def _mp4(file: GrowingFile, first: Pixels, rate: float) -> Generator[None, Pixels]:
    """Encode the received frames by ffmpeg, which writes the file itself."""
    import imageio_ffmpeg

    rows, columns, _ = first.shape
    encoder = imageio_ffmpeg.write_frames(
        str(file.temporary),
        (columns, rows),
        fps=rate,
        codec="libx264",
        macro_block_size=2,
        ffmpeg_log_level="error",
        # The index is at the beginning of the file, so that browsers can play it while it is loaded.
        output_params=["-crf", "18", "-preset", "medium", "-movflags", "+faststart", "-f", "mp4"],
    )
    try:
        encoder.send(None)
        try:
            while True:
                pixels = yield
                encoder.send(pixels.tobytes())
        finally:
            encoder.close()
    except OSError as error:
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise FormatError(
            f"ffmpeg cannot write the video ({reason})",
            where=str(file.path),
            fix="check the free space, or write a .gif file",
        ) from error


def _gif(
    file: GrowingFile, frame: Callable[[int], Pixels], count: int, rate: float
) -> Generator[None, Pixels]:
    """Encode the received frames; each stores the rectangle that differs from the frame before.

    Source: GIF89a specification (CompuServe 1990); Pillow compresses the pixels.
    """
    from PIL import GifImagePlugin, Image

    samples = np.unique(np.linspace(0, count - 1, min(count, _PALETTE_SAMPLES)).astype(int)).tolist()
    palette, background = _palette([frame(k) for k in samples])
    table = bytes(palette.getpalette() or []).ljust(768, b"\0")[:768]
    milliseconds = 1000 * round(GIF_CENTISECONDS / rate) // GIF_CENTISECONDS
    before: NDArray[np.uint8] | None = None
    while True:
        pixels = yield
        image = Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE)
        indices = np.asarray(image).copy()
        indices[(pixels == background).all(axis=2)] = _BACKGROUND  # Pillow finds only a similar colour
        if before is None:
            rows, columns = indices.shape
            file.stream.write(b"GIF89a" + struct.pack("<HHBBB", columns, rows, 0xF7, 0, 0) + table)
            file.stream.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # loop forever
        left, top, right, bottom = _changed(before, indices)
        part = Image.frombytes("P", (right - left, bottom - top), indices[top:bottom, left:right].tobytes())
        part.putpalette(table)
        for block in GifImagePlugin.getdata(part, (left, top), duration=milliseconds):
            file.stream.write(block)
        before = indices


def _palette(frames: list[Pixels]) -> tuple[Image, Pixels]:
    """An image with a palette of 256 colours for all frames, and the most frequent colour (3,)."""
    from PIL import Image

    together = np.concatenate([pixels[::2, ::2].reshape(-1, 3) for pixels in frames])
    colours, counts = np.unique(together, axis=0, return_counts=True)
    background = colours[int(np.argmax(counts))]
    palette = Image.fromarray(together[None]).quantize(255, method=Image.Quantize.MEDIANCUT)
    table = (palette.getpalette() or [])[: 3 * _BACKGROUND]
    palette.putpalette([*table, *[0] * (3 * _BACKGROUND - len(table)), *background.tolist()])
    return palette, background


def _changed(before: NDArray[np.uint8] | None, after: NDArray[np.uint8]) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of the rectangle with all changes; one pixel without a change."""
    if before is None:
        return 0, 0, after.shape[1], after.shape[0]
    changes = before != after
    if not changes.any():
        return 0, 0, 1, 1
    rows, columns = np.flatnonzero(changes.any(axis=1)), np.flatnonzero(changes.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def frame_times(begin: float, end: float, rate: float, speed: float) -> NDArray[np.float64]:
    """The times (s) of the frames from ``begin`` to ``end``, both included.

    ``rate``: frames per second of the video, which is played ``speed`` times as fast as the motion.
    """
    return np.linspace(begin, end, max(1, round((end - begin) / speed * rate) + 1))
