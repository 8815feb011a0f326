"""What a conversion says about the depths of bodies and marks, and about turns out of the plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mocap.measurement import Measurement
from mocap.motion.perspective import UNKNOWN_DEPTH_MM, WELL_TOLD
from mocap.tracking.markers import MarkerFile
from mocap.tracking.noise import camera_shakes


def depth_effect(measured: Measurement, markers: MarkerFile) -> dict[str, Any]:
    """Return the difference of the bodies' scales and the error of ignoring it.

    ``error_without_mm`` is the RMS difference between the measured relative position and the one
    with the package's scale for both bodies; ``error_of_motion_without_mm`` is the same without its
    value in the first frame. If the head has no scale of its own, ``error_per_percent_mm`` is that
    error for each percent by which it appears larger than the package, and ``warnings`` has a
    sentence about it.
    """
    head, package = measured.scales[markers.reference], measured.scales[markers.moving]
    ratio = head.px_per_mm / package.px_per_mm
    report: dict[str, Any] = {
        "own_scale_of_reference": head.source != package.source,
        "reference_over_moving_scale": float(np.mean(ratio)),
        "warnings": [],
    }
    mark = measured.tracks.names.index(markers.bodies[markers.reference][0])
    from_axis = (measured.corrected_px[:, mark] - measured.centre_px) * np.array([1.0, -1.0])
    known = np.isfinite(from_axis[:, 0])
    if head.source == package.source:
        away = from_axis[known] / package.px_per_mm[known, None]
        wrong = 0.01 * float(np.sqrt(np.mean(np.sum(away**2, axis=1))))
        report["error_per_percent_mm"] = wrong
        many = len(markers.bodies[markers.reference]) > 1
        if many and markers.moving in markers.scale_mm and markers.depth is None:
            report["warnings"] = [
                f"[scale] {markers.reference} is not given: both bodies are assumed to be equally "
                f"deep; for each percent by which {markers.reference} appears larger (15 mm "
                f"nearer, at 1.5 m) positions are wrong by {wrong:.1f} mm; {UNKNOWN_DEPTH_MM:g} mm "
                "of depth are in the stated errors: give it as the camera sees it, parallel to the "
                "picture, or give [depth]"
            ]
        return report
    displaced = from_axis * (1 / package.px_per_mm - 1 / head.px_per_mm)[:, None]
    start = displaced[known][0]
    report["error_without_mm"] = float(np.sqrt(np.mean(np.sum(displaced[known] ** 2, axis=1))))
    report["error_of_motion_without_mm"] = float(
        np.sqrt(np.mean(np.sum((displaced[known] - start) ** 2, axis=1)))
    )
    return report


def depth_warnings(measured: Measurement, markers: MarkerFile) -> list[str]:
    """Return what is said about a shaking camera, depths of the marks, and turns."""
    return [
        *_shake_warning(measured, markers),
        *_ratio_warnings(measured, markers),
        *_tilt_warnings(measured),
        *behind_warning(measured, markers),
    ]


def _shake_warning(measured: Measurement, markers: MarkerFile) -> list[str]:
    head, package = (markers.bodies[body][0] for body in (markers.reference, markers.moving))
    if markers.lens.readout_s or not camera_shakes(measured.tracks, head, package):
        return []
    return [
        "the camera shakes: head and package tremble alike; phones expose a picture row by row, "
        "which displaces what shakes: use a tripod, or give [lens] readout_s"
    ]


def _ratio_warnings(measured: Measurement, markers: MarkerFile) -> list[str]:
    warnings = []
    for body, ratio in measured.perspective.ratios.items():
        first, second = markers.bodies[body][:2]
        if ratio.source == "film":
            share = 100 * abs(math.expm1(ratio.log_ratio))
            farther, nearer = (second, first) if ratio.log_ratio > 0 else (first, second)
            warnings.append(
                f"{body}: {farther} is {share:.1f} % farther from the camera than {nearer}, as the "
                "film shows: this is corrected"
            )
        elif ratio.source == "assumed" and ratio.sigma >= WELL_TOLD:
            warnings.append(
                f"{body}: the film hardly tells whether {first} and {second} are equally far from "
                "the camera: they are assumed to be, and the stated errors are larger for it; "
                "give their depths in [depth]"
            )
    return warnings


def _tilt_warnings(measured: Measurement) -> list[str]:
    warnings = []
    for body, scale in measured.scales.items():
        if scale.source == body and scale.tilt_rad.size:
            either = ", or moves in depth" if scale.tilt_may_be_depth else ""
            warnings.append(
                f"{body} turns out of the picture's plane by "
                f"{math.degrees(float(scale.tilt_rad.max())):.0f}° or more{either}: the stated "
                "errors are larger for it"
            )
    return warnings


def behind_warning(measured: Measurement, markers: MarkerFile) -> list[str]:
    """Return what is said of a head that its scale puts too far behind the package."""
    behind, head = measured.perspective.behind, markers.reference
    if not behind:
        return []
    return [
        f"by [scale] {head} = {markers.scale_mm[head]:g} the {head} is {100 * behind:.0f} % "
        f"farther from the camera than the {markers.moving}, though in a side view its marks are "
        "nearer: give their distance parallel to the picture, not straight through space, or give "
        "[depth] instead; the stated errors are larger for it"
    ]
