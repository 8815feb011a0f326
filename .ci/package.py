"""What pyproject.toml and a wheel must agree on.

python .ci/package.py complete WHEEL   every tracked file of the packages lies in the wheel
python .ci/package.py lowest           constraints of pip: the lowest version of each dependency
"""

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def packaged_files() -> set[str]:
    """Return the tracked files of the packages, which a wheel has to hold."""
    patterns = PROJECT["tool"]["setuptools"]["packages"]["find"]["include"]
    folders = [pattern.removesuffix("*") for pattern in patterns]
    listed = subprocess.run(
        ["git", "ls-files", "--", *folders], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return set(listed.stdout.splitlines())


def check_complete(wheel: str) -> None:
    """Stop with the names of what the wheel lacks or has beyond the packages."""
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    wanted = packaged_files()
    if held != wanted:
        sys.exit(f"{wheel} lacks {sorted(wanted - held)} and holds {sorted(held - wanted)} besides")
    print(f"{Path(wheel).name} holds all {len(wanted)} files of the packages")


def lowest() -> list[str]:
    """Return each dependency, of the product and its extras for users, at its lowest release.

    ``numpy>=2.1`` becomes ``numpy==2.1.*``, the last patch of the lowest release, and ``av>=14``
    ``av==14.0.*``.
    """
    extras = PROJECT["project"]["optional-dependencies"]
    asked = [
        *PROJECT["project"]["dependencies"],
        *extras["files"],
        *extras["mark"],
        *extras["notebook"],
        *extras["study"],
    ]
    found = [re.fullmatch(r"([\w.-]+)>=([\d.]+)( *;.*)?", line) for line in asked]
    if unread := [line for line, match in zip(asked, found, strict=True) if match is None]:
        sys.exit(f"no lowest version in {unread}; write NAME>=VERSION")
    return [f"{m[1]}=={m[2] if '.' in m[2] else m[2] + '.0'}.*{m[3] or ''}" for m in found if m]


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["complete", wheel]:
            check_complete(wheel)
        case ["lowest"]:
            print("\n".join(lowest()))
        case _:
            sys.exit(__doc__)
