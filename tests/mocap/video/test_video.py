"""Videos as they are: times, turns, repeats; and files that are no videos."""

from __future__ import annotations

import struct
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from mocap.synthetic.recording_file import write_recording
from mocap.video.frames import Video, VideoError
from mocap.views.summary import video_warnings

LIBRARY = Path(__file__).parents[3] / "scenarios" / "library"
WIDTH, HEIGHT = 96, 64


def pictures(count: int, *, speed: float = 3.0) -> list[np.ndarray]:
    """Frames of a bright square with soft texture moving over a dark ground."""
    rng = np.random.default_rng(1)
    wide = np.kron(rng.uniform(30, 220, (8, 60)), np.ones((8, 8)))
    frames = []
    for k in range(count):
        left = round(k * speed)
        grey = wide[:, left : left + WIDTH].astype(np.uint8)
        frames.append(np.repeat(grey[..., None], 3, axis=2))
    return frames


def written(path: Path, frames: list[np.ndarray], times: np.ndarray | None = None) -> Path:
    times = np.arange(len(frames)) / 25 if times is None else times
    write_recording(path, frames, times, crf=4)
    return path


def test_frames_come_in_order_with_their_own_times(tmp_path: Path) -> None:
    times = np.cumsum(np.array([0, 40, 40, 35, 50, 40, 40, 30, 45])) / 1000
    video = Video(written(tmp_path / "v.mp4", pictures(9), times))
    frames = list(video.frames())
    np.testing.assert_allclose([f.time_s for f in frames], times, atol=1e-4)
    assert [f.index for f in frames] == list(range(9))
    assert frames[0].image.shape == (HEIGHT, WIDTH)
    assert video.timing.variable_rate
    assert not video.timing.dropped


def test_only_the_asked_interval_is_used(tmp_path: Path) -> None:
    video = Video(written(tmp_path / "v.mp4", pictures(10)))
    assert [f.index for f in video.frames(start_s=0.12, end_s=0.2)] == [3, 4, 5]
    with pytest.raises(VideoError, match=r"--start 5; the video runs from 0\.000 s to 0\.36"):
        list(video.frames(start_s=5))


def test_capture_rate_stretches_time(tmp_path: Path) -> None:
    video = Video(written(tmp_path / "v.mp4", pictures(6)), fps=100)
    np.testing.assert_allclose([f.time_s for f in video.frames()], np.arange(6) / 100, atol=1e-4)
    with pytest.raises(VideoError, match="--fps -1"):
        Video(tmp_path / "v.mp4", fps=-1)


def test_missing_frames_are_counted(tmp_path: Path) -> None:
    times = np.delete(np.arange(14) / 25, [5, 6])
    video = Video(written(tmp_path / "v.mp4", pictures(12), times))
    list(video.frames())
    assert video.timing.dropped == ((5, 2),)
    assert "2 frames are missing before 5" in " ".join(video.timing.warnings())


def test_blended_frames_are_found_in_noise(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    frames = pictures(16)
    frames[11] = (0.5 * frames[10] + 0.5 * frames[12]).astype(np.uint8)
    noisy = [np.clip(f + rng.normal(0, 2, f.shape), 0, 255).astype(np.uint8) for f in frames]
    video = Video(written(tmp_path / "v.mp4", noisy))
    list(video.frames())
    assert video.timing.blended == (11,)


def test_repeated_and_blended_frames_are_found(tmp_path: Path) -> None:
    frames = pictures(16)
    frames[6] = frames[5]
    frames[11] = (0.5 * frames[10] + 0.5 * frames[12]).astype(np.uint8)
    video = Video(written(tmp_path / "v.mp4", frames))
    list(video.frames())
    assert video.timing.repeated == (6,)
    assert video.timing.blended == (11,)
    assert video.timing.distrusted == {6, 11}


def test_a_picture_shown_three_times_is_found(tmp_path: Path) -> None:
    frames = pictures(16)
    frames[6] = frames[7] = frames[5]
    video = Video(written(tmp_path / "v.mp4", frames))
    list(video.frames())
    assert video.timing.repeated == (6, 7)
    assert "2 frames (6, 7) repeat" in video.timing.warnings()[0]


@pytest.mark.parametrize("speed", [0.0, 1.0, 3.0])
def test_honest_frames_are_not_accused(tmp_path: Path, speed: float) -> None:
    video = Video(written(tmp_path / "v.mp4", pictures(20, speed=speed)))
    list(video.frames())
    assert video.timing.warnings() == []


def woven(fields: list[np.ndarray], *, upper_first: bool = True) -> list[np.ndarray]:
    """Frames whose alternate rows come from alternate pictures."""
    frames = []
    for one, other in zip(fields[::2], fields[1::2], strict=True):
        frame = (one if upper_first else other).copy()
        frame[1::2] = (other if upper_first else one)[1::2]
        frames.append(frame)
    return frames


def with_noise(frames: list[np.ndarray], spread: float) -> list[np.ndarray]:
    rng = np.random.default_rng(3)
    return [
        np.clip(frame + spread * rng.standard_normal(frame.shape), 0, 255).astype(np.uint8)
        for frame in frames
    ]


@pytest.mark.parametrize("upper_first", [True, False])
@pytest.mark.parametrize("spread", [0.0, 5.0])
def test_interlaced_pictures_that_are_not_said_to_be_are_recognised(
    tmp_path: Path, upper_first: bool, spread: float
) -> None:
    frames = with_noise(woven(pictures(40, speed=2.0), upper_first=upper_first), spread)
    video = Video(written(tmp_path / "v.mp4", frames))
    list(video.frames())
    assert not video.info.interlaced
    assert len(video.timing.combed) > 10
    assert "two instants in alternate rows" in " ".join(video.timing.warnings())
    assert "bwdif" in " ".join(video.timing.warnings())


def test_films_made_into_television_are_recognised(tmp_path: Path) -> None:
    """Of every four pictures five are made; two of the five mix fields of different pictures."""
    films = pictures(24, speed=4.0)
    frames = []
    for a, b, c, d in zip(*(films[k::4] for k in range(4)), strict=True):
        frames += [a, *woven([a, b]), *woven([b, c]), c, d]
    video = Video(written(tmp_path / "v.mp4", frames))
    list(video.frames())
    assert set(video.timing.combed) <= {k for k in range(len(frames)) if k % 5 in (1, 2)}
    assert len(video.timing.combed) > 6


@pytest.mark.parametrize("spread", [3.0, 10.0, 25.0])
@pytest.mark.parametrize("speed", [0.5, 3.0, 7.0])
def test_noise_is_not_taken_for_a_comb(tmp_path: Path, speed: float, spread: float) -> None:
    video = Video(written(tmp_path / "v.mp4", with_noise(pictures(20, speed=speed), spread)))
    list(video.frames())
    assert video.timing.combed == ()


@pytest.mark.parametrize("name", ["A38-F", "A38-AE", "DC-F", "DC-AE"])
def test_nothing_is_held_against_the_library_s_recordings(name: str) -> None:
    video = Video(LIBRARY / name / "recording.mp4")
    frames = sum(1 for _ in video.frames())
    assert frames > 100
    assert video.timing.warnings() == []


def test_a_picture_to_be_turned_is_turned(tmp_path: Path) -> None:
    """The matrix of a phone held upright (a b, c d) = (0 1, −1 0) sends right to down."""
    path = written(tmp_path / "v.mp4", pictures(3))
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40
    one = 1 << 16
    data[at : at + 36] = struct.pack(">9i", 0, one, 0, -one, 0, 0, HEIGHT * one, 0, 1 << 30)
    turned = tmp_path / "turned.mp4"
    turned.write_bytes(data)
    upright = next(iter(Video(path).frames())).image
    video = Video(turned)
    assert (video.info.width, video.info.height) == (HEIGHT, WIDTH)
    image = next(iter(video.frames())).image
    # The upper left corner of the stored picture becomes the upper right one.
    np.testing.assert_array_equal(image[:, -1], upright[0])
    np.testing.assert_array_equal(image[0, ::-1], upright[:, 0])
    assert next(iter(video.frames())).colour().shape == (WIDTH, HEIGHT, 3)


def test_interlaced_material_gives_a_frame_for_each_field(tmp_path: Path) -> None:
    path = tmp_path / "i.mkv"
    frames = pictures(24, speed=2.0)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.options = {"x264-params": "tff=1:interlaced=1", "crf": "4"}
        marked = av.filter.Graph()
        source = marked.add_buffer(
            width=WIDTH, height=HEIGHT, format="yuv420p", time_base=Fraction(1, 25)
        )
        marked.link_nodes(
            source, marked.add("setfield", "mode=tff"), marked.add("buffersink")
        ).configure()
        for k in range(12):
            woven = frames[2 * k].copy()
            woven[1::2] = frames[2 * k + 1][1::2]
            picture = av.VideoFrame.from_ndarray(woven, format="rgb24").reformat(format="yuv420p")
            picture.pts, picture.time_base = k, Fraction(1, 25)
            marked.push(picture)
            container.mux(stream.encode(marked.pull()))
        container.mux(stream.encode())
    video = Video(path)
    assert video.info.interlaced
    times = np.array([f.time_s for f in video.frames()])
    assert len(times) in (23, 24)
    np.testing.assert_allclose(np.diff(times), 0.02, atol=1e-4)


def test_a_file_cut_short_is_refused_with_the_place(tmp_path: Path) -> None:
    path = tmp_path / "v.mp4"
    rng = np.random.default_rng(0)
    noise = [rng.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8) for _ in range(40)]
    write_recording(path, noise, np.arange(40) / 25, crf=10)
    short = tmp_path / "short.mp4"
    whole = path.read_bytes()
    short.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(VideoError, match=r"short\.mp4.*(cut short|cannot be decoded)"):
        list(Video(short).frames())
    assert len(list(Video(short).frames(end_s=0.2))) == 6


def test_a_count_of_frames_that_lies_a_little_is_flagged(tmp_path: Path) -> None:
    path = tmp_path / "v.avi"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=25)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for k, picture in enumerate(pictures(40)):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts = k
            container.mux(stream.encode(frame.reformat(format="yuv420p")))
        container.mux(stream.encode())
    data = bytearray(path.read_bytes())
    length = data.index(b"strh") + 8 + 32
    assert struct.unpack_from("<I", data, length) == (40,)
    for count, refused in ((41, False), (60, True)):
        struct.pack_into("<I", data, length, count)
        path.write_bytes(data)
        video = Video(path)
        assert video.info.declared_frames == count
        if refused:
            with pytest.raises(VideoError, match="announces 60 frames but ends after 40"):
                list(video.frames())
        else:
            assert len(list(video.frames())) == 40
            assert video.timing.frames_in_file == 40
            (warning,) = video_warnings(video.info, video.timing)
            assert "announces 41 frames and holds 40" in warning
    assert len(list(video.frames(end_s=0.2))) == 6
    assert video.timing.frames_in_file is None


def test_not_a_video(tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_text("this is not a video " * 40)
    (tmp_path / "empty.mp4").write_bytes(b"")
    with pytest.raises(VideoError, match="no such video"):
        Video(tmp_path / "none.mp4")
    with pytest.raises(VideoError, match="is a folder"):
        Video(tmp_path)
    with pytest.raises(VideoError, match="is empty"):
        Video(tmp_path / "empty.mp4")
    with pytest.raises(VideoError, match="is not a video that can be read"):
        Video(tmp_path / "text.mp4")


def test_headless_rest_of_a_video(tmp_path: Path) -> None:
    """A recording whose index comes last and was lost, as when a camera's battery dies."""
    path = written(tmp_path / "v.mp4", pictures(10))
    data = path.read_bytes()
    index = data.index(b"moov") - 4
    size = struct.unpack(">I", data[index : index + 4])[0]
    (tmp_path / "dead.mp4").write_bytes(data[:index] + data[index + size :])
    with pytest.raises(VideoError, match=r"dead\.mp4"):
        Video(tmp_path / "dead.mp4")


def test_sound_only(tmp_path: Path) -> None:
    path = tmp_path / "sound.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=48000, layout="mono")
        frame = av.AudioFrame.from_ndarray(
            np.zeros((1, 4096), np.float32), format="fltp", layout="mono"
        )
        frame.sample_rate = 48000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(VideoError, match="holds no picture, only audio"):
        Video(path)


def test_a_picture_stream_without_a_frame(tmp_path: Path) -> None:
    path = tmp_path / "none.mkv"
    with av.open(str(path), "w", format="matroska") as container:
        stream = container.add_stream("mpeg4", rate=Fraction(25))
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        container.start_encoding()
    with pytest.raises(VideoError, match=r"without any frame|is not a video"):
        Video(path)


def test_an_unknown_codec(tmp_path: Path) -> None:
    path = written(tmp_path / "v.mp4", pictures(3))
    data = path.read_bytes()
    (tmp_path / "odd.mp4").write_bytes(data.replace(b"avc1", b"zzz9").replace(b"avcC", b"zzzC"))
    with pytest.raises(VideoError, match=r"codec|cannot be decoded|not a video"):
        Video(tmp_path / "odd.mp4")
