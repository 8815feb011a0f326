"""Checksums of what belongs together in a run directory."""

from pathlib import Path

from scenarios.results.integrity import FILES, differing_input, fingerprint, sealed, write_inputs


def test_what_a_killed_process_left_half_written_does_not_belong_to_a_run(tmp_path: Path) -> None:
    for name in ("history.csv", ".summary.partial-123.json", ".history.partial-123.csv"):
        (tmp_path / name).write_text("x", encoding="utf-8")
    assert list(sealed({}, tmp_path)[FILES]) == ["history.csv"]


def test_a_version_is_named_before_what_it_has_changed(tmp_path: Path) -> None:
    now = fingerprint("[contact]\nfriction = 0.5\n", {"skin.configuration": "a"})
    earlier = {**now, "skin.configuration": "b", "settings": "c"}
    write_inputs(tmp_path, earlier)
    assert differing_input(tmp_path, now) == "another file for skin.configuration"
    write_inputs(tmp_path, {**earlier, "keys": "d"})
    assert "whose settings have other keys" in str(differing_input(tmp_path, now))
    write_inputs(tmp_path, {name: value for name, value in earlier.items() if name != "keys"})
    assert "whose settings have other keys" in str(differing_input(tmp_path, now))
    write_inputs(tmp_path, {**earlier, "version": "0.1.7"})
    assert str(differing_input(tmp_path, now)).startswith("drinksim 0.1.7, this is ")
