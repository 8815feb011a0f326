"""What a page's scripts are given: arrays to the digits shown, and one text of all modules."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from scenarios.views.page.hypertext import page
from scenarios.views.page.packed import ABSENT, packed
from scenarios.views.page.scripts import MODULES, data_element, page_script, script_policy

FOLDER = files("scenarios.views.page") / "scripts"
DEFINED = re.compile(r"^(?:export )?(?:async )?(?:const|class|function) (\w+)", re.MULTILINE)
IMPORTED = re.compile(r'^import \{([^}]*)\} from "\./(\w+)\.js";$', re.MULTILINE)


def read_back(held: dict[str, Any]) -> np.ndarray:
    """Read what the page reads, by the same rules."""
    whole = np.frombuffer(zlib.decompress(base64.b64decode(held["data"])), held["type"])
    whole = np.cumsum(whole.reshape(held["shape"]), axis=0, dtype=held["type"])
    values = whole / 10.0 ** held["decimals"]
    return np.where(whole == ABSENT[held["type"]], np.nan, values)


@given(
    arrays.arrays(
        float, (5, 3), elements=st.floats(-3e4, 3e4, allow_subnormal=False) | st.just(np.nan)
    ),
    st.integers(0, 3),
)
def test_what_is_packed_is_read_to_half_a_digit(values: np.ndarray, decimals: int) -> None:
    found = read_back(packed(values, decimals))
    np.testing.assert_allclose(found, values, rtol=0, atol=0.5001 * 10.0**-decimals)


def test_small_values_take_half_the_room_and_none_overflows() -> None:
    assert packed(np.array([[32.767]]), 3)["type"] == "int16"
    assert packed(np.array([[32.768]]), 3)["type"] == "int32"
    with pytest.raises(OverflowError):
        packed(np.array([[3e6]]), 3)


def test_modules_are_all_there_and_know_only_those_before() -> None:
    texts = {name: (FOLDER / f"{name}.js").read_text(encoding="utf-8") for name in MODULES}
    assert {file.name for file in FOLDER.iterdir()} == {f"{name}.js" for name in MODULES}
    for number, (name, text) in enumerate(texts.items()):
        for names, other in IMPORTED.findall(text):
            assert MODULES.index(other) < number, f"{name} imports {other}"
            assert {word.strip() for word in names.split(",")} <= set(DEFINED.findall(texts[other]))
        assert len(text.splitlines()) <= 300
    defined = [name for text in texts.values() for name in DEFINED.findall(text)]
    assert len(defined) == len(set(defined))


def test_joined_scripts_have_no_imports_and_cannot_end_their_element() -> None:
    script = page_script()
    assert not re.search(r"^(import|export)\b", script, re.MULTILINE)
    assert "</script" not in script.lower()
    assert "fetch(" not in script
    assert "XMLHttpRequest" not in script


def test_a_policy_allows_the_script_alone() -> None:
    script = "let a = 'ü';"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert script_policy(script) == f"'sha256-{digest}'"
    assert "script-src &#x27;none&#x27;" in page("t", "", data_element("d", 1))


def test_data_cannot_become_markup() -> None:
    hostile = '</script><script>alert("x")</script><!--'
    element = data_element("held", {"name": hostile})
    assert element.count("<") == 2
    assert json.loads(element[element.index(">") + 1 : element.rindex("<")])["name"] == hostile
