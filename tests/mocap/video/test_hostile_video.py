"""Videos whose name, size or content would lead astray: refused, or read as what they are."""

from __future__ import annotations

import shutil
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from mocap.synthetic.recording_file import write_recording
from mocap.video import frames
from mocap.video.frames import Video, VideoError


def gif(width: int, height: int, pictures: int = 1) -> bytes:
    """A GIF of pictures in one colour, each a few bytes whatever its size."""
    size = width.to_bytes(2, "little") + height.to_bytes(2, "little")
    control = b"\x21\xf9\x04\x00\x04\x00\x00\x00"
    picture = control + b",\0\0\0\0" + size + b"\0\x02\x02\x44\x01\0"
    return b"GIF89a" + size + b"\x80\0\0\x10\x20\x30\xff\xff\xff" + picture * pictures + b";"


def film(path: Path, count: int = 6, size: tuple[int, int] = (96, 64)) -> Path:
    ramp = np.arange(size[0], dtype=np.uint8)
    pictures = [np.broadcast_to(np.roll(ramp, k)[None, :, None], (size[1], size[0], 3)).copy()
                for k in range(count)]  # fmt: skip
    write_recording(path, pictures, np.arange(count) / 25)
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="a colon is no part of a file's name there")
@pytest.mark.parametrize(
    "name", ["http:x.mp4", "concat:a.mp4|b.mp4", "pipe:0.mp4", "file:x.mp4", "%03d.mp4", "-.mp4"]
)
def test_a_name_is_that_of_a_file_and_no_address(tmp_path: Path, monkeypatch, name: str) -> None:
    shutil.copy(film(tmp_path / "sound.mp4"), tmp_path / name)
    monkeypatch.chdir(tmp_path)
    for path in (Path(name), tmp_path / name):
        assert len(list(Video(path).frames())) == 6
    with pytest.raises(VideoError, match="no such video"):
        Video("http:none.mp4")


@pytest.mark.parametrize(
    "text",
    [
        "ffconcat version 1.0\nfile sound.mp4\n",
        "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nsound.mp4\n#EXT-X-ENDLIST\n",
        '<?xml version="1.0"?>\n<MPD xmlns="urn:mpeg:dash:schema:mpd:2011"></MPD>\n',
        "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\n",
    ],
)
def test_a_list_of_other_files_or_addresses_is_no_video(tmp_path: Path, text: str) -> None:
    film(tmp_path / "sound.mp4")
    for name in ("list.mp4", "list.txt", "list.m3u8"):
        (tmp_path / name).write_text(text)
        with pytest.raises(VideoError, match=rf"{name}: is not a video that can be read"):
            Video(tmp_path / name)


@pytest.mark.parametrize("size", [(16_000, 16_000), (15_000, 9_000), (65_535, 600)])
def test_pictures_larger_than_a_cinema_s_are_refused_unseen(
    tmp_path: Path, monkeypatch, size: tuple[int, int]
) -> None:
    (tmp_path / "tall.gif").write_bytes(gif(*size))

    def decoded(*_: object) -> None:
        raise AssertionError("a picture was decoded")

    monkeypatch.setattr(frames, "luminance", decoded)
    with pytest.raises(VideoError, match=rf"tall\.gif: its pictures are {size[0]} x {size[1]} px"):
        Video(tmp_path / "tall.gif")


def test_a_small_gif_is_read(tmp_path: Path) -> None:
    (tmp_path / "small.gif").write_bytes(gif(320, 200, 5))
    video = Video(tmp_path / "small.gif")
    assert [frame.image.shape for frame in video.frames()] == [(200, 320)] * 5


def test_what_unfolds_without_end_is_stopped(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "many.gif").write_bytes(gif(320, 200, 60))
    monkeypatch.setattr(frames, "PIXELS_OF_ANY_FILE", 1e6)
    monkeypatch.setattr(frames, "MOST_PIXELS_PER_BYTE", 100)
    with pytest.raises(VideoError, match=r"many\.gif: unfolds to more than 1\.0e\+06 pixels until"):
        list(Video(tmp_path / "many.gif").frames())


def test_more_frames_than_a_day_are_refused(tmp_path: Path, monkeypatch) -> None:
    path = film(tmp_path / "long.mp4")
    monkeypatch.setattr(frames, "MOST_FRAMES", 5)
    with pytest.raises(VideoError, match=r"long\.mp4: announces 6 frames, more than 5"):
        Video(path)


def test_pictures_that_change_their_size_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "changing.ts"
    with path.open("wb") as joined:
        for size in ((96, 64), (128, 96)):
            part = tmp_path / "part.ts"
            with av.open(str(part), "w") as container:
                stream = container.add_stream("mpeg2video", rate=Fraction(25))
                stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
                for _ in range(4):
                    picture = np.full((size[1], size[0], 3), 90, np.uint8)
                    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                    container.mux(stream.encode(frame.reformat(format="yuv420p")))
                container.mux(stream.encode())
            joined.write(part.read_bytes())
    with pytest.raises(VideoError, match=r"changing\.ts: frame \d+ is"):
        list(Video(path).frames())
