"""Prints the lowest versions that pyproject.toml declares, as constraints for pip."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
extras = project["optional-dependencies"]
for line in [*project["dependencies"], *extras["joblib"], *extras["slurm"], *extras["test"]]:
    bound = re.fullmatch(r"([\w.-]+)>=([\w.]+)(,.*)?", line)
    if bound:
        print(f"{bound[1]}=={bound[2]}")
