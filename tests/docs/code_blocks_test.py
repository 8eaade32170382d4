#!/usr/bin/env python3
"""Runs the code blocks of README.md and docs/*.md, so that no page shows what does not work.

Each ```sh block runs in one shell, in a scratch folder with examples/ beside it and `tribin` on the path. A block that
begins with "# not run here: why" is only read: the reason stands in it. usage: code_blocks_test.py TRIBIN WORK_DIR
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def main():
    tribin, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    (work / "examples").symlink_to(ROOT / "examples")
    environment = dict(os.environ, PATH=f"{tribin.parent}:{os.environ['PATH']}")
    failures = runs = 0
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for language, block in BLOCK.findall(page.read_text(encoding="utf-8")):
            if language == "":
                continue
            if language != "sh":
                print(f"{page.name}: a block of '{language}' is not run; use sh, or no language for what is only shown")
                failures += 1
                continue
            if block.startswith("# not run here:") or block.startswith("./demo"):
                continue  # ./demo and ./test are run by themselves: one is this test's parent
            runs += 1
            done = subprocess.run(["sh", "-eu", "-c", block], cwd=work, env=environment, capture_output=True, text=True)
            if done.returncode != 0:
                failures += 1
                print(f"{page.name}: exit code {done.returncode} of\n{block}{done.stderr}")
    print(f"{runs} code blocks run, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
