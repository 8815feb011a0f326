"""The summary of a conversion: ``summary.json``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from geometry2d.rigid import rotated
from mocap.measurement import Measurement
from mocap.motion.capture import Capture
from mocap.motion.poses import Poses
from mocap.motion.projection import PictureFormat
from mocap.motion.scale import BodyScale
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks
from mocap.video.info import VideoInfo
from mocap.video.times import Timing
from mocap.views.depths import depth_effect, depth_warnings


def summary(
    info: VideoInfo,
    timing: Timing,
    markers: MarkerFile,
    measured: Measurement,
    picture: PictureFormat,
) -> dict[str, Any]:
    """Return the summary of a conversion, as values for JSON.

    Parameters
    ----------
    info, timing
        Format of the video and timing of its frames.
    markers, measured, picture
        Marker file, measurement and picture format.
    """
    captured, motion = measured.capture, measured.motion
    depth = depth_effect(measured, markers)
    warnings = [*video_warnings(info, timing), *_measurement_warnings(measured, markers)]
    warnings += depth.pop("warnings") + depth_warnings(measured, markers)
    return {
        "command": "drinksim convert",
        "recording": {
            "video": info.path.name,
            "rendered": markers.rendered,
            "codec": info.codec,
            "width_px": info.width,
            "height_px": info.height,
            "rotation_deg": info.rotation_deg,
            "mirrored": measured.mirrored,
            "interlaced": info.interlaced,
            "frames_declared": info.declared_frames,
            "frames_in_file": timing.frames_in_file,
            "frames_used": timing.frames,
            "first_s": timing.first_s,
            "last_s": timing.last_s,
            "median_interval_s": timing.median_interval_s,
            "variable_rate": timing.variable_rate,
            "repeated_frames": list(timing.repeated),
            "blended_frames": list(timing.blended),
            "dropped_frames": [list(times) for times in timing.dropped],
            "combed_frames": list(timing.combed),
        },
        "markers": {name: _marker(measured.tracks, name) for name in measured.tracks.names},
        "scale": {body: _scale(scale) for body, scale in measured.scales.items()},
        "depth": depth,
        "bodies": {
            body: {
                "markers": list(pose.markers),
                "turns": pose.turns,
                "rigid": pose.rigid,
                "residual_rms_mm": pose.residual_rms_mm,
                "expected_residual_mm": pose.expected_residual_mm,
            }
            for body, pose in captured.poses.items()
        },
        "first_frame": {
            f"{body.name}_axis_deg": None if body.axis_rad is None else math.degrees(body.axis_rad)
            for body in (motion.head_body, motion.package_body)
        },
        "other_bodies": {body: _other(pose, captured) for body, pose in captured.others.items()},
        "smoothing": {
            name: {
                "cutoff_hz": result.cutoff_hz,
                "removed_rms": result.removed_rms,
                "noise_found_over_stated": result.noise_factor,
                "rate_sigma_median": float(np.median(result.rate_sigma)),
            }
            for name, result in captured.smoothing.items()
        },
        "relative": {
            "moving": markers.moving,
            "reference": markers.reference,
            "first_frame": int(captured.frame[0]),
            "last_frame": int(captured.frame[-1]),
            "start_x_mm": float(motion.relative_mm[0, 0]),
            "start_y_mm": float(motion.relative_mm[0, 1]),
            "range_x_mm": float(np.ptp(motion.relative_mm[:, 0])),
            "range_y_mm": float(np.ptp(motion.relative_mm[:, 1])),
            "range_theta_deg": float(np.degrees(np.ptp(motion.relative_rad))),
            "sigma_x_mm_median": float(np.median(motion.sigma[:, 0])),
            "sigma_y_mm_median": float(np.median(motion.sigma[:, 1])),
            "sigma_theta_deg_median": float(np.degrees(np.median(motion.sigma[:, 2]))),
            "level_assumed": markers.plane is None,
            "roll_mm_per_deg": float(np.radians(np.median(np.hypot(*motion.relative_mm.T)))),
        },
        "drinking": motion.drinking(measured.lip).as_json(),
        "warnings": warnings,
    }


def write_summary(report: dict[str, Any], path: Path) -> None:
    """Write a summary as JSON; numbers that are not finite become null."""
    text = json.dumps(_finite(report), indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _other(pose: Poses, captured: Capture) -> dict[str, Any]:
    """Return whether another body is rigid, and its motion relative to the reference body."""
    seen = rotated(
        pose.position_mm - captured.poses[captured.motion.head_body.name].position_mm,
        -captured.motion.head_rad,
    )
    return {
        "markers": list(pose.markers),
        "rigid": pose.rigid,
        "residual_rms_mm": pose.residual_rms_mm,
        "expected_residual_mm": pose.expected_residual_mm,
        "moves_on_reference_mm": float(np.hypot(*np.ptp(seen, axis=0))),
        "turns_on_reference_deg": float(
            np.degrees(np.ptp(pose.angle_rad - captured.motion.head_rad))
        ),
    }


def _marker(tracks: Tracks, name: str) -> dict[str, Any]:
    status = tracks.status[:, tracks.names.index(name)]
    _, sigma = tracks.of(name)
    seen = sigma[tracks.known(name)]
    return {
        **{kind: int(np.sum(status == kind)) for kind in ("seen", "fixed", "predicted", "lost")},
        "sigma_px_median": float(np.median(seen)) if seen.size else math.nan,
    }


def _scale(scale: BodyScale) -> dict[str, Any]:
    return {
        "px_per_mm_first": float(scale.px_per_mm[0]),
        "px_per_mm_last": float(scale.px_per_mm[-1]),
        "relative_sigma": scale.relative_sigma,
        "from_marks_of": scale.source,
        "change": scale.change,
        "foreshortened_frames": len(scale.foreshortened),
        "enlarged_frames": len(scale.enlarged),
        "flattening_share": scale.flattening.share,
        "flattening_share_sigma": scale.flattening.sigma,
    }


def video_warnings(info: VideoInfo, timing: Timing) -> list[str]:
    """Return the warnings about a file and its frames, one sentence each."""
    warnings = timing.warnings()
    warnings += _length_warnings(info, timing)
    if info.rotation_deg:
        warnings.append(f"the picture is rotated by {info.rotation_deg}°, as the file asks")
    if info.interlaced:
        warnings.append("the picture is interlaced: each field is used as a frame")
    if info.pixel_aspect != 1.0:
        warnings.append(
            f"pixels are {info.pixel_aspect:.4g} times as wide as high: this is corrected"
        )
    return warnings


def _length_warnings(info: VideoInfo, timing: Timing) -> list[str]:
    """Return what a file announces and does not hold, or holds and does not announce."""
    held, announced, missing = timing.frames_in_file, info.declared_frames, timing.missing_s
    if held is None or missing is None or info.interlaced:
        return []
    if announced and held != announced and abs(missing) > 0.5 * timing.median_interval_s:
        return [f"the file announces {announced} frames and holds {held}: all are used"]
    if not announced and info.ends_early(missing):
        return [
            f"the file announces {info.declared_end_s:.2f} s and its pictures end "
            f"{missing:.2f} s earlier: all are used; if it was cut short, copy it again"
        ]
    return []


def _measurement_warnings(measured: Measurement, markers: MarkerFile) -> list[str]:
    warnings = []
    captured, tracks = measured.capture, measured.tracks
    if measured.mirrored:
        warnings.append(
            "the person faces left: left and right are exchanged in the motion, so that x points "
            "to where the face looks; tracks.csv has the pixels of the film"
        )
    for name in tracks.names:
        lost = int(np.sum(tracks.status[:, tracks.names.index(name)] == "lost"))
        if lost:
            warnings.append(f"{name} is lost in {lost} of {tracks.frame.size} frames")
    if captured.frame.size < tracks.frame.size:
        warnings.append(
            f"the motion covers frames {captured.frame[0]} to {captured.frame[-1]} of "
            f"{tracks.frame[0]} to {tracks.frame[-1]}: elsewhere markers are missing"
        )
    for body, pose in captured.poses.items():
        if not pose.turns:
            warnings.append(f"{body} has one marker: its rotation is not known and set to zero")
        if not pose.rigid:
            warnings.append(
                f"{body} is not rigid: the residual of its markers is {pose.residual_rms_mm:.2f} "
                f"mm RMS, {pose.expected_residual_mm:.2f} mm are expected"
            )
    for body, pose in captured.others.items():
        if not pose.rigid:
            warnings.append(
                f"{body} is not rigid ({pose.residual_rms_mm:.2f} mm RMS): skin slides; it is not "
                "used for the motion"
            )
    for body, scale in measured.scales.items():
        if scale.source != body or markers.has_sticker(body):
            continue
        cause = scale.flattening.cause.value
        for frames, how in ((scale.foreshortened, "close together"), (scale.enlarged, "far apart")):
            if frames:
                warnings.append(
                    f"{body}: its marks appear too {how} in {len(frames)} frames; {cause}"
                )
        if scale.change > 0.02:
            warnings.append(
                f"{body}: its apparent size changes by {100 * scale.change:.1f} %, which is "
                f"followed as depth; {cause}"
            )
    return warnings


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
