#!/usr/bin/env python3
"""tribin pick in a simulated cell: a dry run, a run with its journal and page, and what is refused.

usage: pick_test.py TRIBIN WORK_DIR. Exit code 77 = the component for simulation is missing.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import unittest

try:
    import jsonschema
except ImportError:
    jsonschema = None

ROOT = pathlib.Path(__file__).resolve().parents[2]
TRIBIN, WORK = sys.argv[1], pathlib.Path(sys.argv[2])
CELL = str(ROOT / "examples/cells/pick_cell.toml")


def pick(*arguments):
    return subprocess.run([TRIBIN, "pick", "--workcell", CELL, *arguments], capture_output=True, text=True, cwd=WORK)


class Pick(unittest.TestCase):
    def lines(self, text):
        lines = [json.loads(line) for line in text.splitlines()]
        if jsonschema:
            schema = json.loads((ROOT / "schema/pick_cycle.schema.json").read_text(encoding="utf-8"))
            for line in lines:
                jsonschema.validate(line, schema)
        return lines

    def test_a_dry_run_is_the_default_and_moves_nothing(self):
        done = pick("--simulate", "3", "--seed", "2")
        self.assertEqual(done.returncode, 0, done.stderr)
        (line,) = self.lines(done.stdout)
        self.assertEqual(line["state"], "planned")
        self.assertFalse(list(WORK.glob("*.ndjson")))

    def test_a_part_goes_from_bin_to_slot(self):
        done = pick("--simulate", "3", "--seed", "2", "--arm", "--parts", "1", "--journal", "rack.ndjson", "--report", "run")
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = self.lines(done.stdout)
        self.assertEqual(lines[-1]["status"], "most_parts")
        self.assertEqual(lines[-1]["placed"], 1)
        (placed,) = [line for line in lines if line.get("state") == "placed"]
        self.assertEqual(lines[-1]["rack"][placed["slot"] - 1], placed["part"])
        events = [json.loads(line)["event"] for line in (WORK / "rack.ndjson").read_text().splitlines()]
        self.assertEqual(events[-1], "placed")
        self.assertEqual(events.count("placed") + events.count("picked"), 2 * events.count("picked"))
        page = (WORK / "run/index.html").read_text(encoding="utf-8")
        self.assertIn(placed["part"], page)
        self.assertIn("1 part placed: as many as were asked for", page)
        self.assertIn("data:image/png;base64,", page)

    def test_what_is_refused(self):
        text = pathlib.Path(CELL).read_text(encoding="utf-8").replace('"../', f'"{ROOT}/examples/')
        text = text.replace('file = "pick_camera.json"', f'file = "{ROOT}/examples/cells/pick_camera.json"')
        (WORK / "no_consent.toml").write_text(text.replace("allow_arm = true", "allow_arm = false"), encoding="utf-8")
        done = subprocess.run([TRIBIN, "pick", "--workcell", "no_consent.toml", "--simulate", "1", "--arm"],
                              capture_output=True, text=True, cwd=WORK)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("allow_arm", done.stderr)
        done = pick(str(ROOT / "examples/cells/pick_camera.json"), "--arm")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("--tools-confirmed", done.stderr)


if __name__ == "__main__":
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    if "install lib" in pick("--simulate", "1").stderr:
        print("SKIPPED: simulation is not built in")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
