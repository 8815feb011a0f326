"""What is measured on the lips in a committed state: from fields and contacts to numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem2d.body.surface import Surface
from fem2d.contact.rigid import RigidContact, RigidContactResponse, rigid_responses
from fem2d.solvers.commit import Commit
from fem2d.solvers.hand import resultant
from fem2d.solvers.stability import Passage
from geometry2d.rigid import RigidMotion, rotated
from scenarios.results.increment import ContactField, Measured
from scenarios.results.quantities import LIPS
from scenarios.sip.contact_line import ContactLine, line_on_neck, recovered_traction
from scenarios.sip.felt import Felt, seal_margin_mpa
from scenarios.sip.lip_model import Lips
from scenarios.sip.lip_muscles import fibre_activation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LipMeasures:
    """Measures the fields of the dermis and the contact of each lip with the neck.

    Parameters
    ----------
    lips
        The model, in the frame of the head section.
    head_angle_rad
        Turn of that frame into the head frame, in which forces are given.
    motion
        Of the neck as it was filmed.
    """

    lips: Lips
    head_angle_rad: float
    motion: RigidMotion

    def measured(self, commit: Commit) -> Measured:
        """Return element fields, contact fields and history columns of a committed increment."""
        fields = self.lips.fem_model.fields(commit.state)
        volume = fields.volume / fields.volume.sum(axis=1, keepdims=True)
        strain = fields.log_strain
        history = {
            "dermis_min_log_strain": float(strain[self._dermis].min()),
            "dermis_max_log_strain": float(strain[self._dermis].max()),
            "dermis_max_mises_kpa": 1e3 * float(fields.von_mises[self._dermis].max()),
        }
        for lip in LIPS:
            history |= self._lip_history(lip, commit)
        history |= self._neck_history(commit)
        return Measured(
            element={
                "log_strain_min": np.sum(volume * strain.min(axis=-1), axis=1),
                "log_strain_max": np.sum(volume * strain.max(axis=-1), axis=1),
                "von_mises_mpa": np.sum(volume * fields.von_mises, axis=1),
                "thickness_stretch": np.sum(volume * fields.thickness_stretch, axis=1),
                "activation": fibre_activation(
                    self.lips.body, self.lips.muscles, commit.state.time_s
                ),
            },
            contact={lip: self._contact_field(lip, commit) for lip in LIPS},
            history=history,
            recovered_window_kpa={
                lip: 1e3 * self._contact_line(lip, commit).recovered_window() for lip in LIPS
            },
        )

    def located(self, passage: Passage) -> dict[str, Any]:
        """Return when and where the equilibrium was unstable, for the summary.

        The place is that of the node that moves most in the softest mode: the nearest lip, the arc
        length on its skin, mm, and the position in the head frame, mm.
        """
        worst = passage.worst
        lip, arc_mm = self._place_on_skin(worst.node)
        x, y = self.in_head_frame(worst.place_mm).tolist()
        return {
            "from_s": passage.start_s,
            "to_s": passage.end_s,
            "modes": worst.modes,
            "lip": lip,
            "arc_mm": arc_mm,
            "x_mm": x,
            "y_mm": y,
        }

    def in_head_frame(self, vectors: ArrayLike) -> Array:
        """Return vectors (..., 2) of the head section's frame in the head frame."""
        return rotated(vectors, self.head_angle_rad)

    @cached_property
    def _skin(self) -> dict[str, Surface]:
        return {lip: self.lips.free_surface(lip) for lip in LIPS}

    @cached_property
    def _dermis(self) -> NDArray[np.intp]:
        body = self.lips.body
        return np.concatenate([body.elements_of(f"{lip}_dermis") for lip in LIPS])

    def _place_on_skin(self, node: int) -> tuple[str, float]:
        """Return the lip whose skin is nearest to a node, and the arc length there, mm."""
        body = self.lips.body
        nearest: list[tuple[float, str, float]] = []
        for lip, skin in self._skin.items():
            away = skin.positions(np.zeros_like(body.nodes)) - body.nodes[node]
            distance = np.linalg.norm(away, axis=-1)
            at = np.unravel_index(np.argmin(distance), distance.shape)
            nearest.append((float(distance[at]), lip, float(skin.arc_length[at])))
        _, lip, arc_mm = min(nearest)
        return lip, arc_mm

    def _lip_history(self, lip: str, commit: Commit) -> dict[str, float]:
        line = self._contact_line(lip, commit)
        force = self.in_head_frame(self._force_on_neck(lip, commit))
        felt = Felt.of(line)
        held_back = self._held_back_mpa(lip, commit)
        return {
            f"{lip}_lip_pressure_kpa": 1e3 * line.top_two_edges(),
            f"{lip}_lip_window_kpa": 1e3 * line.highest_window(),
            f"{lip}_lip_contact_mm": felt.touched_mm,
            f"{lip}_lip_force_x_n": float(force[0]),
            f"{lip}_lip_force_y_n": float(force[1]),
            f"{lip}_lip_force_n": float(np.hypot(*force)),
            f"{lip}_lip_mean_kpa": 1e3 * felt.mean_mpa,
            f"{lip}_lip_window_1mm_kpa": 1e3 * felt.peak_1mm_mpa,
            f"{lip}_lip_window_1_5mm_kpa": 1e3 * felt.peak_1_5mm_mpa,
            f"{lip}_lip_crest_contrast": felt.crest_contrast,
            f"{lip}_lip_seal_kpa": 1e3 * seal_margin_mpa(line, held_back),
        }

    def _held_back_mpa(self, lip: str, commit: Commit) -> Array | float:
        """Return the pressure that a seal has to hold back at each node of a lip's edges, MPa."""
        if self.lips.liquid is None:
            return 0.0
        position = self._skin[lip].positions(commit.state.displacement)
        return self.lips.liquid(commit.state.time_s).held_back_mpa(position)

    def _neck_history(self, commit: Commit) -> dict[str, float]:
        touching = [r for r in rigid_responses(commit.contacts) if r.contact.moving]
        here, filmed = commit.state.placement, self.motion.at(commit.state.time_s)
        away = np.subtract(here.shift_mm, filmed.shift_mm)
        return {
            "neck_moment_nmm": float(resultant(touching, here)[2]),
            "neck_off_film_mm": float(np.hypot(*away)),
            "neck_off_film_deg": float(np.rad2deg(here.angle_rad - filmed.angle_rad)),
            "liquid_kpa": 1e3 * self._liquid_at_rim_mpa(commit.state.time_s),
        }

    def _liquid_at_rim_mpa(self, time_s: float) -> float:
        liquid = self.lips.liquid
        return 0.0 if liquid is None else liquid.at_rim_mpa(time_s)

    def _on_neck(self, lip: str, commit: Commit) -> list[tuple[RigidContact, RigidContactResponse]]:
        """Return the contacts of a lip with the walls of the neck, and their responses."""
        return [
            (response.contact, response)
            for response in rigid_responses(commit.contacts)
            if response.contact.moving and response.contact.name.startswith(lip)
        ]

    def _contact_line(self, lip: str, commit: Commit) -> ContactLine:
        on_neck = [response for _, response in self._on_neck(lip, commit)]
        return line_on_neck(self._skin[lip], on_neck, commit.state.displacement)

    def _force_on_neck(self, lip: str, commit: Commit) -> Array:
        force = np.zeros(2)
        for _, response in self._on_neck(lip, commit):
            force -= response.force.reshape(-1, 2).sum(axis=0)
        return force

    def _contact_field(self, lip: str, commit: Commit) -> ContactField:
        walls, skin = self._on_neck(lip, commit), self._skin[lip]
        deformed = skin.weight * skin.stretch(commit.state.displacement)
        gaps = [contact.surface.nodal(response.points.gap) for contact, response in walls]
        nearest = np.argmin(gaps, axis=0)

        def of_nearest_wall(name: str) -> Array:
            values = np.stack([c.surface.nodal(getattr(r.points, name)) for c, r in walls])
            taken: Array = np.take_along_axis(values, nearest[None], axis=0)[0]
            return taken

        # A node that two edges share is a point of both and carries what both give it.
        place, first, node = np.unique(skin.arc_length, return_index=True, return_inverse=True)

        def traction(name: str) -> Array:
            carried = [c.surface.carried(getattr(r.points, name)) for c, r in walls]
            force = np.zeros(len(place))
            np.add.at(force, node.ravel(), np.sum(carried, axis=0).ravel())
            return recovered_traction(force, deformed.sum(axis=1))

        pressure = traction("pressure")
        neck_arc = of_nearest_wall("outline_arc").ravel()[first]
        return ContactField(
            arc_mm=place,
            pressure_mpa=pressure,
            shear_mpa=traction("shear"),
            gap_mm=of_nearest_wall("gap").ravel()[first],
            neck_arc_mm=np.where(pressure > 0, neck_arc, np.nan),
        )
