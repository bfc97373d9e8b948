# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Writes pictures as PNG, SVG, GIF or MP4 and their data as CSV: the same bytes each time."""

from contextlib import contextmanager
import csv
import math
from pathlib import Path
import subprocess
import tempfile

import matplotlib
import numpy as np
from PIL import Image

PALETTE_FRAMES = 8
FREQUENT = 0.3  # of a GIF's colours: the most frequent ones
FINEST = 100  # the unit of time in a GIF is a hundredth of a second

# Fonts as outlines, and names from a fixed salt: an SVG that is the same everywhere.
SVG = {'svg.hashsalt': 'linkage_ros', 'svg.fonttype': 'path'}

# Options of ffmpeg for files without time, place and machine.
REPRODUCIBLE = ('-threads', '1', '-fflags', '+bitexact', '-flags:v', '+bitexact',
                '-map_metadata', '-1')


def still(picture, turns, file: Path):
    """Write a picture at a time [turns] as PNG or SVG."""
    picture.show(turns)
    format_ = file.suffix[1:].lower()
    metadata = {'png': {'Software': None}, 'svg': {'Date': None}}[format_]
    with matplotlib.rc_context(SVG), replacing(file) as new:
        picture.figure.savefig(new, format=format_, metadata=metadata)


def gif(picture, times, fps, loop, colours, file: Path, progress):
    """
    Write a picture at some times as a GIF, with one palette for all frames.

    Parameters
    ----------
    picture : Picture
        Picture to animate.
    times : sequence of float
        Times of the frames [turns].
    fps : float
        Frames per second.
    loop : int
        Number of repetitions; 0: endless.
    colours : int
        Largest number of colours.
    file : Path
        Output file.
    progress : callable
        Yields the times one by one.

    """
    sample = [picture.at(turns) for turns in times[::-(-len(times) // PALETTE_FRAMES)]]
    palette = Palette(np.stack(sample), colours)
    frames = [palette.reduced(picture.at(turns)) for turns in progress(times)]
    ends = [round(FINEST * k / fps) for k in range(len(frames) + 1)]
    repeats = {} if loop == 1 else {'loop': max(loop - 1, 0)}
    with replacing(file) as new:
        frames[0].save(new, 'GIF', save_all=True, append_images=frames[1:],
                       duration=[1000 // FINEST * int(d) for d in np.diff(ends)], **repeats)


class Palette:
    """The colours of a GIF: the most frequent, and those farthest from all chosen before."""

    def __init__(self, pixels, count):
        colours, counts = np.unique(packed(pixels), return_counts=True)
        colours = unpacked(colours[np.argsort(-counts, kind='stable')]).astype(int)
        chosen = list(colours[:math.ceil(FREQUENT * count)])
        apart = np.min([squares(colours - colour) for colour in chosen], axis=0)
        while len(chosen) < count and apart.any():
            chosen.append(colours[apart.argmax()])
            apart = np.minimum(apart, squares(colours - chosen[-1]))
        self._colours = np.array(chosen)

    def reduced(self, pixels):
        """Return an image whose pixels have the nearest colours of the palette."""
        colours, places = np.unique(packed(pixels), return_inverse=True)
        apart = squares(unpacked(colours)[:, None].astype(int) - self._colours)
        nearest = np.argmin(apart, axis=1).astype(np.uint8)
        image = Image.fromarray(nearest[places].reshape(pixels.shape[:2]))
        image.putpalette(self._colours.ravel().tolist())
        return image


def squares(differences):
    """Return the squared lengths of vectors (..., 3)."""
    return (differences * differences).sum(axis=-1)


def packed(pixels):
    """Return colours (..., 3), 8 bits each, as one number each."""
    return pixels.astype(np.int64) @ (1 << 16, 1 << 8, 1)


def unpacked(colours):
    """Return numbers as colours (..., 3), 8 bits each."""
    return (colours[..., None] >> np.array([16, 8, 0]) & 255).astype(np.uint8)


def mp4(picture, times, fps, file: Path, progress):
    """Write a picture at some times as MP4; raise OSError with ffmpeg's message if it fails."""
    height, width, _ = picture.at(times[0]).shape
    with replacing(file) as new, tempfile.TemporaryFile() as messages:
        encoder = subprocess.Popen([
            'ffmpeg', '-v', 'error', '-y', '-f', 'rawvideo', '-pix_fmt', 'rgb24',
            '-video_size', f'{width}x{height}', '-framerate', f'{fps:g}', '-i', '-',
            '-c:v', 'libx264', '-crf', '18', '-pix_fmt', 'yuv420p', '-movflags', '+faststart',
            *REPRODUCIBLE, '-f', 'mp4', new], stdin=subprocess.PIPE, stderr=messages)
        try:
            assert encoder.stdin
            with encoder.stdin as pipe:
                for turns in progress(times):
                    pipe.write(picture.at(turns).tobytes())
        except BrokenPipeError:
            pass
        if encoder.wait():
            messages.seek(0)
            raise OSError(f'ffmpeg failed: {messages.read().decode(errors="replace").strip()}')


def data(picture, times, file: Path):
    """Write the drawn data: time [s], inputs [rad or m] and joints [m], one row per picture."""
    with replacing(file) as new, open(new, 'w', newline='') as lines:
        writer = csv.writer(lines, lineterminator='\n')
        writer.writerow(['time', *(name for panel in picture.panels for name in panel.columns())])
        for turns in times:
            picture.show(turns)
            values = [value for panel in picture.panels for value in panel.values()]
            writer.writerow([picture.seconds(turns), *values])


@contextmanager
def replacing(file: Path):
    """Yield the path of a new file, which replaces the old one on success."""
    new = file.with_name(f'.{file.name}.new')
    try:
        yield new
        new.replace(file)
    finally:
        new.unlink(missing_ok=True)
