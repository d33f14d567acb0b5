"""What building adds to the files as they are: the commit, and links in the README that work anywhere."""

import re
import subprocess
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = r"\[([^\]]+)\]\((?![a-z]+:|#)([^)]+)\)"  # to a file beside the README
KEPT = "mpmbench/commit.txt"  # read by mpmbench.results.provenance where there is no checkout


class Commit(BuildHookInterface):
    """Puts the commit into a wheel and into an archive of the sources; without ``.git`` nothing is added."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before the build of a target; an editable install reads its checkout."""
        if version == "editable" or not (Path(self.root) / ".git").exists():
            return
        try:
            commit = self.git("rev-parse", "HEAD")
            files = ("mpmbench", "conf")
            changes = self.git("status", "--porcelain", "--untracked-files=no", "--", *files)
        except (OSError, subprocess.SubprocessError):
            return
        file = Path(mkdtemp(prefix="mpmbench-build-")) / "commit.txt"
        file.write_text(f"{commit} {'yes' if changes else 'no'}\n")
        build_data["force_include"][str(file)] = KEPT

    def git(self, *arguments: str) -> str:
        """What git says about these files."""
        command = ["git", "-C", self.root, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
        return done.stdout.strip()


class Readme(MetadataHookInterface):
    """Makes the README the long description, with links to files of the repository that lead there.

    Where the project has no address of its sources, the words of such links stay and lead nowhere.
    """

    def update(self, metadata: dict[str, Any]) -> None:
        """Called with the metadata of the project, which have its URLs already."""
        source = metadata.get("urls", {}).get("Source", "").rstrip("/")
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        text = re.sub(LINK, rf"[\1]({source}/\2)" if source else r"\1", text)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
