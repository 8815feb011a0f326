"""Films of other containers, trimmed films, damaged films: nothing is refused for a wrong reason.

Where a message says ``--end``, reading ends there without it.
"""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from mocap.video.frames import Video, VideoError
from mocap.views.summary import video_warnings
from tests.support.containers import encoded, trimmed

WIDTH, HEIGHT = 96, 64


def pictures(count: int) -> list[np.ndarray]:
    """Pictures whose mean grey level tells their number, with a texture that moves."""
    rng = np.random.default_rng(2)
    wide = np.kron(rng.uniform(-40, 40, (8, 8 + count)), np.ones((8, 8)))
    return [
        np.repeat(
            np.clip(wide[:, 3 * k : 3 * k + WIDTH, None] + 60 + 3 * k, 0, 255).astype(np.uint8),
            3,
            axis=2,
        )
        for k in range(count)
    ]


def numbers(video: Video) -> list[int]:
    """Which pictures are shown, told by their contents."""
    means = np.array([picture.mean() for picture in pictures(40)])
    return [
        int(np.argmin(np.abs(means - frame.colour().mean(dtype=float)))) for frame in video.frames()
    ]


@pytest.mark.parametrize("bframes", [0, 2])
@pytest.mark.parametrize(
    ("edits", "shown", "first_s"),
    [
        ([(0.8, 0.4)], [*range(10, 30)], 0.0),
        ([(0.6, 0.52)], [*range(13, 28)], 0.0),
        ([(0.5, -1.0), (0.8, 0.4)], [*range(10, 30)], 0.5),
        ([(0.3, -1.0), (1.6, 0.0)], [*range(40)], 0.3),
        ([(0.4, 0.2), (0.4, 0.6)], [*range(5, 25)], 0.0),
    ],
)
def test_a_trimmed_film_shows_what_its_edit_list_says(
    tmp_path: Path, edits: list[tuple[float, float]], shown: list[int], first_s: float, bframes: int
) -> None:
    options = {"crf": "6", "x264-params": f"bframes={bframes}:keyint=12"}
    whole = encoded(tmp_path / "whole.mp4", pictures(40), 25, options=options)
    video = Video(trimmed(whole, tmp_path / "trimmed.mp4", edits))
    times = np.array([frame.time_s for frame in video.frames()])
    kept = np.round((times - first_s) * 25).astype(int)
    assert numbers(video) == [shown[k] for k in kept]
    np.testing.assert_allclose(times, first_s + kept / 25, atol=1e-3)
    # Where edits meet among pictures that are stored out of order, one may be given another's time.
    left_out = len(video.timing.unshown)
    assert left_out <= (len(edits) > 1 and bframes > 0)
    assert kept.size == len(shown) - left_out
    said = video_warnings(video.info, video.timing)
    assert not any("announces" in sentence for sentence in said)
    assert left_out == sum("has the time of the frame before" in sentence for sentence in said)


@pytest.mark.parametrize("ending", ["mkv", "flv"])
@pytest.mark.parametrize("rate", [25, 30, Fraction(30000, 1001), Fraction(60000, 1001)])
def test_an_even_rate_is_even_behind_a_clock_of_milliseconds(
    tmp_path: Path, rate: Fraction | int, ending: str
) -> None:
    video = Video(encoded(tmp_path / f"v.{ending}", pictures(40), rate))
    times = np.array([frame.time_s for frame in video.frames()])
    np.testing.assert_allclose(times - times[0], np.arange(40) / float(rate), atol=1e-4)
    assert not video.timing.variable_rate
    assert video_warnings(video.info, video.timing) == []


def test_a_rate_that_varies_varies_behind_a_clock_of_milliseconds(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    at = np.arange(40) / 25 + rng.uniform(0, 0.012, 40)
    video = Video(encoded(tmp_path / "v.mkv", pictures(40), 25, times_s=at.tolist()))
    times = np.array([frame.time_s for frame in video.frames()])
    np.testing.assert_allclose(times, at, atol=1.6e-3)
    assert (np.diff(times) > 0).all()
    assert video.timing.variable_rate


def test_frames_a_tick_apart_stay_in_order(tmp_path: Path) -> None:
    at = np.cumsum([0, *([40, 1, 79] * 10)]) / 1000
    video = Video(encoded(tmp_path / "v.mkv", pictures(31), 25, times_s=at.tolist()))
    times = np.array([frame.time_s for frame in video.frames()])
    assert times.size == 31
    assert (np.diff(times) > 0).all()
    np.testing.assert_allclose(times, at, atol=1.1e-3)


def test_matroska_cut_short_says_so(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    noise = [rng.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8) for _ in range(40)]
    whole = encoded(tmp_path / "v.mkv", noise, 25)
    video = Video(whole)
    list(video.frames())
    assert not any("announces" in said for said in video_warnings(video.info, video.timing))
    short = tmp_path / "short.mkv"
    short.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    video = Video(short)
    assert 10 < len(list(video.frames())) < 30
    (said,) = video_warnings(video.info, video.timing)
    assert re.search(r"announces 1\.60 s and its pictures end 0\.\d+ s earlier", said)


def test_a_stream_without_times_has_those_of_the_rate_given(tmp_path: Path) -> None:
    path = encoded(tmp_path / "v.h264", pictures(20), 25)
    with pytest.raises(VideoError, match="its frames carry no times; give --fps"):
        Video(path)
    times = [frame.time_s for frame in Video(path, fps=50).frames()]
    np.testing.assert_allclose(times, np.arange(20) / 50)


@pytest.mark.parametrize(
    ("ending", "codec"),
    [
        ("mp4", "libx264"),
        ("avi", "mpeg4"),
        ("avi", "mjpeg"),
        ("mkv", "libx264"),
        ("ts", "libx264"),
        ("gif", "gif"),
    ],
)
def test_the_end_that_a_message_names_is_one_that_can_be_read_to(
    tmp_path: Path, ending: str, codec: str
) -> None:
    rng = np.random.default_rng([7, len(ending), len(codec)])
    noise = [rng.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8) for _ in range(30)]
    rate = Fraction(30000, 1001)
    whole = encoded(
        tmp_path / f"v.{ending}", noise, rate, codec=codec, contents_first=ending == "mp4"
    )
    data = whole.read_bytes()
    advised = 0
    damaged = tmp_path / f"d.{ending}"
    for _ in range(12):
        harmed = bytearray(data[: int(rng.integers(len(data) // 4, len(data) + 1))])
        for at in rng.integers(len(data) // 8, len(harmed), int(rng.integers(0, 40))):
            harmed[at] = rng.integers(0, 256)
        damaged.write_bytes(harmed)
        try:
            list(Video(damaged).frames())
        except VideoError as error:
            end = re.search(r"--end (\S+)$", str(error))
            if end is None:
                continue
            advised += 1
            assert len(list(Video(damaged).frames(end_s=float(end[1])))) >= 2, error
    # What streams without a table of contents is read as far as it goes.
    assert advised >= {"mp4": 6, "avi": 6}.get(ending, 0)
