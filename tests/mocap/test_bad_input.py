"""Each wrong input of a conversion has its own message, and nothing is written."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import av
import numpy as np
import pytest

from mocap.convert import convert
from mocap.formats.marker_table import MarkerTable
from mocap.formats.trc import write_trc
from mocap.synthetic.recording_file import write_recording
from mocap.video.frames import Video
from tests.support.clips import Clip

CLIP = Clip(width=480, height=300, px_per_mm=1.45, frames=14)


@dataclass(frozen=True)
class Inputs:
    """What a conversion is given."""

    video: Path
    markers: Path
    tracks: Path | None = None
    end_s: float | None = None


@cache
def good() -> Inputs:
    video, markers, _ = CLIP.write(Path(mkdtemp(prefix="good")))
    return Inputs(video, markers)


def pictures() -> list[np.ndarray]:
    return [frame.colour()[..., ::-1] for frame in Video(good().video).frames()]


def rewritten(folder: Path, frames: list[np.ndarray]) -> Inputs:
    write_recording(folder / "in.mp4", frames, np.arange(len(frames)) / 25)
    return replace(good(), video=folder / "in.mp4")


def marker_file(folder: Path, change: Callable[[str], str]) -> Inputs:
    text = good().markers.read_text(encoding="utf-8")
    assert change(text) != text
    (folder / "in.toml").write_text(change(text), encoding="utf-8")
    return replace(good(), markers=folder / "in.toml")


def without_positions(folder: Path) -> Inputs:
    return marker_file(folder, lambda text: re.sub(r"\n\w+ = \[.*\]", "", text))


def tracks_file(folder: Path, rows: str) -> Inputs:
    (folder / "in.csv").write_text(f"frame,time_s,marker,x_px,y_px,sigma_px,status\n{rows}")
    return replace(good(), tracks=folder / "in.csv")


def trc_cut_short(folder: Path) -> Inputs:
    file = folder / "in.trc"
    write_trc(MarkerTable(np.arange(14) / 25, ("ear",), np.ones((14, 1, 3)), "mm"), file)
    file.write_text("".join(file.read_text().splitlines(keepends=True)[:-3]))
    return replace(good(), tracks=file)


def cut_short(folder: Path) -> Inputs:
    rng = np.random.default_rng(0)
    noise = [rng.integers(0, 255, picture.shape, np.uint8) for picture in pictures()]
    shown = [np.where(np.arange(480)[None, :, None] < 60, n, p)
             for n, p in zip(noise, pictures(), strict=True)]  # fmt: skip
    whole = rewritten(folder, shown).video.read_bytes()
    (folder / "in.mp4").write_bytes(whole[: int(0.6 * len(whole))])
    return replace(good(), video=folder / "in.mp4")


def without_index(folder: Path) -> Inputs:
    """As when a camera's battery dies."""
    data = good().video.read_bytes()
    index = data.index(b"moov") - 4
    size = int.from_bytes(data[index : index + 4], "big")
    (folder / "in.mp4").write_bytes(data[:index] + data[index + size :])
    return replace(good(), video=folder / "in.mp4")


def unknown_codec(folder: Path) -> Inputs:
    data = good().video.read_bytes()
    (folder / "in.mp4").write_bytes(data.replace(b"avc1", b"zzz9").replace(b"avcC", b"zzzC"))
    return replace(good(), video=folder / "in.mp4")


def sound_only(folder: Path) -> Inputs:
    with av.open(str(folder / "in.mp4"), "w") as container:
        stream = container.add_stream("aac", rate=48000, layout="mono")
        silence = np.zeros((1, 4096), np.float32)
        frame = av.AudioFrame.from_ndarray(silence, format="fltp", layout="mono")
        frame.sample_rate = 48000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return replace(good(), video=folder / "in.mp4")


def no_frames(folder: Path, name: str, codec: str) -> Inputs:
    with av.open(str(folder / name), "w") as container:
        stream = container.add_stream(codec, rate=Fraction(25))
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        container.start_encoding()
    return replace(good(), video=folder / name)


def never_visible(folder: Path) -> Inputs:
    """A picture with shapes, none of them round and small."""
    rows, columns = np.indices((300, 480))
    shapes = np.where((rows // 60 + columns // 80) % 2, 90, 200).astype(np.uint8)
    return rewritten(folder, [np.repeat(shapes[..., None], 3, axis=2)] * 14)


def visible_once(folder: Path) -> Inputs:
    frames = pictures()
    return rewritten(folder, [frames[0], *never_seen(len(frames) - 1)])


def never_seen(count: int) -> list[np.ndarray]:
    return [np.full((300, 480, 3), 150 + k % 2, np.uint8) for k in range(count)]


def coinciding(text: str) -> str:
    lower = re.search(r"package_lower = (.*)", text)
    assert lower
    return re.sub(r"package_upper = .*", f"package_upper = {lower[1]}", text)


CASES: dict[str, tuple[Callable[[Path], Inputs], str]] = {
    "no such video": (
        lambda folder: replace(good(), video=folder / "none.mp4"),
        r"none\.mp4: no such video; check the path",
    ),
    "cut short": (cut_short, r"in\.mp4: (cannot be decoded after frame \d+|announces 14 frames)"),
    "index lost": (without_index, r"in\.mp4: is not a video that can be read.*cut short"),
    "unknown codec": (unknown_codec, r"in\.mp4: .*the codec of its picture is unknown; convert it"),
    "sound only": (sound_only, r"in\.mp4: holds no picture, only audio"),
    "no frames": (
        lambda folder: no_frames(folder, "in.avi", "mpeg4"),
        r"in\.avi: holds a mpeg4 stream without any frame",
    ),
    "nothing at all": (
        lambda folder: no_frames(folder, "in.mp4", "libx264"),
        r"in\.mp4: is an empty container without any frame",
    ),
    "one frame": (
        lambda folder: rewritten(folder, pictures()[:1]),
        r"in\.mp4: holds a single frame; a motion needs at least two",
    ),
    "one frame used": (lambda _: replace(good(), end_s=0.0), r"only one frame is used.*--end"),
    "all black": (
        lambda folder: rewritten(folder, [np.zeros((300, 480, 3), np.uint8)] * 14),
        r"frame 0 shows nothing",
    ),
    "markers never visible": (
        never_visible,
        r"\w+: no dark, light or coloured spot",
    ),
    "no face and no package": (
        lambda folder: replace(never_visible(folder), markers=without_positions(folder).markers),
        r"frame 0: 0 round spots were found for 4 markers \(ear, nose, package_lower, ",
    ),
    "markers visible once": (
        visible_once,
        r"both bodies have all their markers in a single frame only \(frame 0\)",
    ),
    "position off the picture": (
        lambda folder: marker_file(folder, lambda t: re.sub(r"ear = .*", "ear = [4000, 10]", t)),
        r"ear = \[4000, 10\] lies off the picture of 480 x 300",
    ),
    "marks coincide": (
        lambda folder: marker_file(folder, coinciding),
        r"package_lower and package_upper coincide",
    ),
    "not finite": (
        lambda folder: marker_file(folder, lambda t: t.replace("package = 14.0", "package = nan")),
        r"\[scale\] package = nan: has to be a finite number",
    ),
    "unknown key": (
        lambda folder: marker_file(folder, lambda t: t.replace("package =", "pakage =")),
        r"\[scale\] has no key 'pakage' \(did you mean 'package'\?\)",
    ),
    "not TOML": (
        lambda folder: marker_file(folder, lambda t: t.replace("[scale]", "[scale")),
        r"is not valid TOML",
    ),
    "row there twice": (
        lambda folder: tracks_file(folder, "3,0.12,ear,1,2,0.1,seen\n" * 2),
        r"in\.csv line 3: frame 3 of 'ear' is there twice; remove one row",
    ),
    "row cut short": (
        lambda folder: tracks_file(folder, "3,0.12,ear,1,2,0.1,seen\n4,0.16,ear,1"),
        r"in\.csv line 3: was cut short in its last row",
    ),
    "no rows": (lambda folder: tracks_file(folder, ""), r"holds no rows below its header"),
    "tracks of another video": (
        lambda folder: tracks_file(folder, "900,36.0,ear,100,100,0.1,fixed\n"),
        r"--tracks: none of its frames \(900 to 900\) is used \(0 to 13\)",
    ),
    "tracks at other times": (
        lambda folder: tracks_file(folder, "3,9.5,ear,100,100,0.1,fixed\n"),
        r"--tracks: frame 3 is at 9\.5 s there and at 0\.12 s in the video",
    ),
    "position by hand off the picture": (
        lambda folder: tracks_file(folder, "3,0.12,ear,5000,100,0.1,fixed\n"),
        r"--tracks: ear in frame 3 lies at \[5000, 100\], off the picture of 480 x 300",
    ),
    "trc cut short": (trc_cut_short, r"in\.trc: announces 14 frames and holds 11"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_wrong_input_is_named_and_nothing_is_written(tmp_path: Path, case: str) -> None:
    make, words = CASES[case]
    given = make(tmp_path)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(ValueError, match=words) as caught:
        convert(
            given.video,
            given.markers,
            out=tmp_path / "out",
            tracks=given.tracks,
            end_s=given.end_s,
        )
    assert type(caught.value).__module__.startswith("mocap.")
    assert "\n" not in str(caught.value) or case == "not TOML"
    assert sorted(tmp_path.iterdir()) == before


def test_no_two_wrong_inputs_share_a_message() -> None:
    words = [words for _, words in CASES.values()]
    assert len(set(words)) == len(words)


def test_the_good_input_is_good() -> None:
    (said,) = convert(good().video, good().markers).warnings
    # Half a second of a head does not tell how deep its marks are.
    assert "hardly tells whether ear and nose are equally far" in said
