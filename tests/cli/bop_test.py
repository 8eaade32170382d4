#!/usr/bin/env python3
"""tribin bop, merge and eval on a small simulated data set: shards, restarts, the format of the results.

usage: bop_test.py TRIBIN WORK_DIR
"""
import json
import pathlib
import shutil
import subprocess
import sys
import time
import unittest

import small_dataset

ROOT = pathlib.Path(__file__).resolve().parents[2]
TRIBIN, WORK = sys.argv[1], pathlib.Path(sys.argv[2])
SCENES = 5


def run(*arguments):
    return subprocess.run([TRIBIN, *map(str, arguments)], capture_output=True, text=True, timeout=300)


class Bop(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        WORK.mkdir(parents=True)
        cls.data = small_dataset.simulated(TRIBIN, WORK / "data", SCENES)
        if cls.data is None:
            raise unittest.SkipTest("SKIPPED: the simulated camera is not built in")
        cls.whole = WORK / "whole.csv"
        done = run("bop", cls.data, "--no-times", "-o", cls.whole)
        assert done.returncode == 0, done.stderr

    def validate(self, schema, document):
        path = WORK / (schema + ".json")
        path.write_text(document)
        checked = subprocess.run([sys.executable, ROOT / "tools/validate_json", ROOT / f"schema/{schema}.schema.json", path],
                                 capture_output=True, text=True)
        self.assertIn(checked.returncode, (0, 77), checked.stdout + checked.stderr)  # 77: no python3-jsonschema

    def same_as_whole(self, results):
        for extension in (".csv", ".ndjson"):
            self.assertEqual(results.with_suffix(extension).read_bytes(), self.whole.with_suffix(extension).read_bytes())

    def test_the_csv_is_that_of_bop_and_the_records_are_results_of_locate(self):
        head, *rows = self.whole.read_text().splitlines()
        self.assertEqual(head, "scene_id,im_id,obj_id,score,R,t,time")
        instances = 0
        for line in self.whole.with_suffix(".ndjson").read_text().splitlines():
            record = json.loads(line)
            self.validate("locate", line)
            for instance in record["instances"]:
                scene, image, obj, score, r, t, seconds = rows[instances].split(",")
                self.assertEqual((int(scene), int(image)), (record["scene_id"], record["im_id"]))
                self.assertIn({"obj_id": int(obj), "part": instance["part"]}, record["offered"])
                self.assertEqual(float(score), instance["score"])
                self.assertEqual([float(x) for x in r.split(" ")], sum(instance["camera_from_part"]["rotation"], []))
                self.assertEqual([float(x) for x in t.split(" ")], instance["camera_from_part"]["translation_mm"])
                self.assertEqual(float(seconds), -1)
                instances += 1
        self.assertEqual(instances, len(rows))
        self.assertGreater(instances, 0)

    def test_shards_join_to_the_bytes_of_one_run(self):
        shards = []
        for i in (3, 1, 2):  # 3/3 is 0/3
            shards.append(WORK / f"shard_{i}.csv")
            done = run("bop", self.data, "--no-times", "--shard", f"{i}/3", "--threads", 1, "-o", shards[-1])
            self.assertEqual(done.returncode, 0, done.stderr)
        images = [len(s.with_suffix(".ndjson").read_text().splitlines()) for s in shards]
        self.assertEqual(sum(images), SCENES)
        done = run("merge", *shards, "-o", WORK / "merged.csv")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.same_as_whole(WORK / "merged.csv")

    def test_a_run_that_was_killed_goes_on_to_the_same_bytes(self):
        out = WORK / "killed.csv"
        images = WORK / "killed.images"
        process = subprocess.Popen([TRIBIN, "bop", self.data, "--no-times", "-o", out],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.time() + 100
        while process.poll() is None and not list(images.glob("0*.ndjson")) and time.time() < deadline:
            time.sleep(0.01)
        process.kill()
        process.wait()
        kept = {path: path.stat().st_mtime_ns for path in images.glob("0*.ndjson")}
        self.assertTrue(kept)
        done = run("bop", self.data, "--no-times", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.same_as_whole(out)
        for path, made in kept.items():
            self.assertEqual(path.stat().st_mtime_ns, made, "what was finished is not done again")

    def test_only_parts_that_the_targets_name_are_offered(self):
        targets = WORK / "targets.json"
        targets.write_text(json.dumps([{"im_id": 0, "inst_count": 1, "obj_id": 2, "scene_id": 4}]))
        done = run("bop", self.data, "--targets", targets, "-o", WORK / "one.ndjson")
        self.assertEqual(done.returncode, 0, done.stderr)
        records = [json.loads(line) for line in (WORK / "one.ndjson").read_text().splitlines()]
        self.assertEqual([(r["scene_id"], [o["obj_id"] for o in r["offered"]]) for r in records], [(4, [2])])
        self.assertGreater(records[0]["stages_ms"]["total"], 0)

    def test_results_are_judged_alike_as_csv_and_as_ndjson(self):
        judged = []
        for extension in (".csv", ".ndjson"):
            out = run("eval", self.data, self.whole.with_suffix(extension), "--json", "-")
            self.assertEqual(out.returncode, 0, out.stderr)
            self.validate("eval", out.stdout)
            judged.append(json.loads(out.stdout))
            text = run("eval", self.data, self.whole.with_suffix(extension), "--list")
            self.assertIn("found of >= 40 % visible", text.stdout)
        csv, full = judged
        self.assertEqual((full["images"], full["images_without_result"]), (SCENES, 0))
        for group in csv["groups"] + full["groups"]:  # the CSV does not hold what was listed as uncertain
            for key in [k for k in group if k.startswith("withheld")]:
                self.assertIn("count", group.pop(key))
        self.assertEqual(csv["groups"], full["groups"])
        self.assertGreater(full["groups"][0]["recall_40"]["share"], 0.5)
        self.assertEqual(csv["confidence"]["coverage_95"], [])
        right = full["groups"][0]["answers"]["found"] + full["groups"][0]["answers"]["not_asked"]
        self.assertEqual(full["confidence"]["coverage_95"][0]["inside"]["of"], right)

    def test_what_cannot_be_is_one_sentence(self):
        targets = WORK / "bad_targets.json"
        targets.write_text(json.dumps([{"im_id": 0, "obj_id": 9, "scene_id": 1}]))
        other = WORK / "other.csv"
        other.write_text(self.whole.read_text().replace("\n1,0,", "\n1,0,7", 1))
        text = WORK / "text.csv"
        text.write_text("nonsense\n")
        for arguments, code, words in [
            (["bop", self.data, "--shard", "4/3", "-o", WORK / "x.csv"], 2, "--shard"),
            (["bop", self.data, "-o", WORK / "x.txt"], 2, ".csv"),
            (["bop", self.data, "--no-times", "--method", "paper", "-o", self.whole], 2, "another -o"),
            (["bop", self.data, "--split", "train", "-o", WORK / "x.csv"], 3, "train"),
            (["bop", WORK / "none", "-o", WORK / "x.csv"], 3, "models"),
            (["bop", self.data, "--targets", targets, "-o", WORK / "x.csv"], 3, "object 9"),
            (["merge", self.whole, WORK / "missing.csv", "-o", WORK / "x.csv"], 3, "missing.csv"),
            (["merge", self.whole, other, "-o", WORK / "x.csv"], 3, "two files"),
            (["merge", text, "-o", WORK / "x.csv"], 3, "line 1"),
            (["eval", self.data, text], 3, "line 1"),
            (["eval", WORK / "none", self.whole], 3, "models_info.json"),
        ]:
            out = run(*arguments)
            self.assertEqual((out.returncode, out.stderr.count("\n")), (code, 1), out.stderr)
            self.assertIn(words, out.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
