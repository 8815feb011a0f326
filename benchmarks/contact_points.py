"""Where along an edge contact is sampled: pressures, penetration and force under a crest.

    python -m benchmarks.contact_points

A soft quadratic block is pressed 0.3 mm by the flat crest of a thread, 1.6 mm wide with corners of
0.4 mm. The first table gives pressures from the middle of the crest outwards for four ways to
sample; the second how deep edges sink over a corner, with nodes anywhere, and the force.
"""

from __future__ import annotations

from tests.support.contact_models import force_on_tissue
from tests.support.crest import pressed_by_crest, pressure_under_crest

SAMPLINGS = {
    "four Gauss points": {"points_per_edge": 4},
    "two Gauss points": {"points_per_edge": 2},
    "nodes, Simpson's weights": {"at_nodes": True},
}
EDGES_MM = (0.1, 0.2, 0.3, 0.4)
ASIDE = (0.0, 0.1, 0.2, 0.3, 0.4)
"""Places of the nodes against the crest, in edges."""


def sunk(edge_mm: float, between_nodes: int) -> str:
    """Return the ranges of the largest penetration, mm, and of the force, N, over the places."""
    depth, force = [], []
    for aside in ASIDE:
        _, last = pressed_by_crest(
            edge_mm, aside=aside * edge_mm, at_nodes=True, between_nodes=between_nodes
        )
        depth.append(last.contacts[0].contact.deepest(last.contacts[0]))
        force.append(-force_on_tissue(last)[1])
    return f"{min(depth):.4f}–{max(depth):.4f} mm, {min(force):.4f}–{max(force):.4f} N"


def main() -> None:
    print("pressures from the middle of the crest outwards, kPa, edges of 0.15 mm")
    for name, points in SAMPLINGS.items():
        _, pressure = pressure_under_crest(0.15, **points)
        print(f"  {name:<26}", " ".join(f"{value:.0f}" for value in pressure if value > 0))
    _, pressure = pressure_under_crest(0.05, at_nodes=True)
    third = " ".join(f"{value:.0f}" for value in pressure[::3] if value > 0)
    print(f"  {'nodes, edges of 0.05 mm':<26}", third, "(every third)")
    print("\nlargest penetration and force, nodes at five places")
    for edge in EDGES_MM:
        print(f"  edges of {edge} mm   nodes alone {sunk(edge, 0)}")
        print(f"                    with points between {sunk(edge, 2)}")


if __name__ == "__main__":
    main()
