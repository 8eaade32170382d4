#!/usr/bin/env python3
"""The command line's contract: exit codes, messages, help, schemas, same bytes, nothing half written.

usage: cli_test.py TRIBIN WORK_DIR
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("TRIBIN_DATA", ROOT / "../shared/data"))
SCENES = DATA / "scenes_dev"
COMMANDS = ["locate", "segment", "normals", "part", "convert", "patterns", "scan", "simulate", "simulate-controller",
            "robot-server", "grasps", "calibrate", "bop", "merge", "eval", "bench"]
TRIBIN, WORK = sys.argv[1], pathlib.Path(sys.argv[2])


def run(*arguments, **options):
    return subprocess.run([TRIBIN, *map(str, arguments)], capture_output=True, text=True, timeout=300, **options)


def box_stl(path, size=(60, 40, 30)):
    corner = [[size[k] if i >> k & 1 else 0 for k in range(3)] for i in range(8)]
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
             (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    lines = ["solid box"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex %g %g %g" % tuple(corner[i]) for i in face] + ["endloop", "endfacet"]
    path.write_text("\n".join(lines + ["endsolid box", ""]))
    return path


def validated(test, schema, document):
    path = WORK / (schema + ".json")
    path.write_text(document)
    checked = subprocess.run([sys.executable, ROOT / "tools/validate_json", ROOT / f"schema/{schema}.schema.json", path],
                             capture_output=True, text=True)
    if checked.returncode != 77:  # python3-jsonschema is there
        test.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
    return json.loads(document)


class Options(unittest.TestCase):
    def test_each_command_has_help_with_an_example(self):
        for command in COMMANDS:
            out = run(command, "--help")
            self.assertEqual(out.returncode, 0, command)
            self.assertIn("Example:\n  tribin " + command, out.stdout)

    def test_version(self):
        out = run("--version")
        self.assertEqual((out.returncode, out.stdout), (0, "tribin 0.1.0\n"))

    def test_bad_options_are_one_sentence_and_exit_code_2(self):
        box = box_stl(WORK / "box.stl")
        other = WORK / "other"
        other.mkdir(exist_ok=True)
        box_stl(other / "box.stl")
        for arguments, words in [
            ([], "subcommand"),
            (["locate"], "SCAN"),
            (["locate", "scan.pcd"], "--part"),
            (["locate", "scan.pcd", "--part", box, "--frobnicate"], "--frobnicate"),
            (["locate", "scan.pcd", "--part", box, "--tolerance-mm", "-1"], "--tolerance-mm"),
            (["locate", "scan.pcd", "--part", box, "--part", other / "box.stl"], "named 'box'"),
            (["locate", "scan.pcd", "--part", box, "--method", "magic"], "--method"),
            (["locate", "scan.pcd", "--part", box, "--cell-px", "3"], "--expert"),
            (["part", box, "--unit", "furlong"], "furlong"),
            (["part", box, "--json", WORK / "no/such/folder/x.json"], "does not exist"),
        ]:
            out = run(*arguments)
            self.assertEqual(out.returncode, 2, arguments)
            self.assertEqual(out.stderr.count("\n"), 1, out.stderr)
            self.assertIn(words, out.stderr)
            self.assertEqual(out.stdout, "")

    def test_bad_files_are_one_sentence_and_exit_code_3(self):
        text = WORK / "text.stl"
        text.write_text("this is not a part\n")
        for arguments in (["part", text], ["part", WORK / "missing.stl"], ["segment", WORK / "missing.pcd"]):
            out = run(*arguments)
            self.assertEqual(out.returncode, 3, out.stderr)
            self.assertEqual(out.stderr.count("\n"), 1, out.stderr)
            self.assertIn(pathlib.Path(arguments[1]).name, out.stderr)
            self.assertEqual(out.stdout, "")


class Bin(unittest.TestCase):
    def test_an_empty_bin_is_found_and_empty_wherever_it_is_said_to_stand(self):
        box = box_stl(WORK / "box.stl")
        made = run("simulate", "--part", box, "--kind", "empty", "--seed", 3, "-o", WORK / "empty_bin", "-q")
        if made.returncode == 2:
            self.skipTest("tribin is built without the simulator")
        self.assertEqual(made.returncode, 0, made.stderr)
        scene = WORK / "empty_bin/test/000001"
        info = json.loads((WORK / "empty_bin/scene_info.json").read_text())["1"]
        bin_file = WORK / "bin.toml"
        size = "[bin]\ninner_size_mm = %s\nwall_mm = %s\n" % (info["bin_inner_mm"], info["wall_mm"])
        arguments = ["locate", scene / "depth/000000.png", "--camera", scene / "scene_camera.json", "--part", box,
                     "--bin", bin_file, "--json", "-"]
        bin_file.write_text(size)
        out = run(*arguments)
        self.assertEqual(out.returncode, 1, out.stderr)
        sought = validated(self, "locate", out.stdout)
        self.assertEqual((sought["status"], sought["unexplained"]), ("empty", []))
        self.assertTrue(sought["bin"]["found"])
        self.assertNotIn("drift_sigma", sought["bin"])
        # Said to stand 10 mm beside where it does: the alarm, and the same place.
        x, y, z = sought["bin"]["camera_from_bin"]["translation_mm"]
        bin_file.write_text(size + "base_from_bin = {translation_mm = [%f, %f, %f], rotation_deg = "
                            "{convention = 'yaskawa', values = [180, 0, 0]}}\n" % (x + 10, y, z))
        out = run(*arguments, "--report", WORK / "bin_report")
        given = validated(self, "locate", out.stdout)
        self.assertIn("calibration_drift", [warning["code"] for warning in given["warnings"]])
        for a, b in zip(given["bin"]["camera_from_bin"]["translation_mm"], (x, y, z)):
            self.assertAlmostEqual(a, b, delta=0.5)
        self.assertIn("Bin and the rest", (WORK / "bin_report/index.html").read_text())
        bin_file.write_text("[bin]\ninner_size_mm = [460, 360]\n")
        out = run(*arguments)
        self.assertEqual(out.returncode, 3, out.stderr)
        self.assertIn("inner_size_mm", out.stderr)


class Served:
    """A command that serves until it is told to end; its port is in its first line."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([TRIBIN, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.first = self.process.stdout.readline()
        self.port = int(re.search(r"port (\d+)", self.first).group(1)) if "port" in self.first else 0

    def talk(self, text, until, timeout=120):
        with socket.create_connection(("127.0.0.1", self.port), timeout=timeout) as link:
            link.sendall(text.encode())
            answer = b""
            while until.encode() not in answer:
                piece = link.recv(4096)
                if not piece:
                    break
                answer += piece
        return answer.decode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate(timeout=20)


class RobotCommands(unittest.TestCase):
    def test_the_simulated_controller_speaks_host_control(self):
        with Served("simulate-controller", "nx100", "--port", 0, "--start") as served:
            answer = served.talk("CONNECT Robot_access Keep-Alive:-1\r\nHOSTCTRL_REQUEST RSTATS 0\r\n", "202,64")
            self.assertEqual(answer, "OK: NX Information Server( 1.16) Keep-Alive:-1.\r\nOK: RSTATS\r\n202,64\r")
        unfilled = run("simulate-controller", "nx100", "--robot", ROOT / "examples/robots/da20.toml", "--port", 0)
        self.assertEqual((unfilled.returncode, unfilled.stderr.count("\n")), (3, 1))
        self.assertIn("to be filled in", unfilled.stderr)
        for arguments, words in [(["fanuc"], "nx100 or hses"), (["nx100", "--fault", "flood"], "delayed_answer"),
                                 (["nx100", "--address", "nowhere"], "IPv4")]:
            out = run("simulate-controller", *arguments, "--port", 0)
            self.assertEqual((out.returncode, out.stderr.count("\n")), (2, 1), out.stderr)
            self.assertIn(words, out.stderr)


class PartCommand(unittest.TestCase):
    def test_a_box_has_six_planes(self):
        out = run("part", box_stl(WORK / "box.stl"), "--json", "-")
        self.assertEqual(out.returncode, 0, out.stderr)
        part = validated(self, "part", out.stdout)
        self.assertEqual([p["type"] for p in part["primitives"]], ["plane"] * 6)

    def test_a_kept_part_gives_the_same_bytes(self):
        cache = WORK / "cache"
        shutil.rmtree(cache, ignore_errors=True)
        environment = dict(os.environ, XDG_CACHE_HOME=str(cache))
        arguments = ["part", ROOT / "examples/parts/alternator_b.stl", "--json", "-", "--no-times"]
        without = run(*arguments, "--no-cache", env=environment)
        self.assertFalse(cache.exists())
        first, second = (run(*arguments, "-v", env=environment) for _ in range(2))
        self.assertEqual(len(list((cache / "tribin/parts").iterdir())), 1)
        self.assertIn(str(cache), second.stderr)
        self.assertEqual(without.stdout, first.stdout)
        self.assertEqual(without.stdout, second.stdout)

    def test_the_report_is_one_page_without_network(self):
        dir = WORK / "part_report"
        shutil.rmtree(dir, ignore_errors=True)
        out = run("part", box_stl(WORK / "box.stl"), "--report", dir, "--no-times")
        self.assertEqual(out.returncode, 0, out.stderr)
        page = (dir / "index.html").read_text()
        for forbidden in ("http://", "https://", "<script src", "@import", "url("):
            self.assertFalse(forbidden in page, forbidden)
        validated(self, "part", (dir / "report.json").read_text())
        self.assertEqual(sorted(p.name for p in dir.iterdir()), ["index.html", "report.json"])


class CaptureCommands(unittest.TestCase):
    def test_a_camera_that_is_the_projector_needs_another_place(self):
        frames = WORK / "patterns"
        shutil.rmtree(frames, ignore_errors=True)
        out = run("patterns", "--size", "320x64", "--set", "heterodyne", "-o", frames, "--camera", "eye")
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertEqual(len(list(frames.glob("*.png"))), len(json.loads((frames / "frames.json").read_text())["cameras"][0]["patterns"]))
        camera = {"name": "eye", "width": 320, "height": 64, "K": [400, 0, 160, 0, 400, 32, 0, 0, 1]}
        # A camera turned and moved against the projector, whose frames are the projector's own pictures: a surface at
        # which each pixel meets its own column.
        beside = dict(camera, name="projector", K=[400, 0, 240, 0, 400, 32, 0, 0, 1],
                      rig_from_camera={"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation_mm": [100, 0, 0]})
        (WORK / "rig.json").write_text(json.dumps({"cameras": [camera], "projector": beside}))
        scan, report = WORK / "scan.pcd", WORK / "scan_report"
        out = run("scan", frames, "--calibration", WORK / "rig.json", "-o", scan, "--report", report)
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertIn("points", out.stdout)
        self.assertNotIn("http", (report / "index.html").read_text())
        out = run("convert", scan, WORK / "scan.ply")
        self.assertEqual(out.returncode, 0, out.stderr)
        for arguments, code, words in [
            (["scan", frames, "--calibration", WORK / "none.json", "-o", scan], 3, "none.json"),
            (["patterns", "--size", "big", "-o", frames], 2, "WIDTHxHEIGHT"),
            (["patterns", "--steps", "2", "-o", frames], 2, "3..8"),
            (["patterns", "--set", "magic", "-o", frames], 2, "heterodyne"),
        ]:
            out = run(*arguments)
            self.assertEqual((out.returncode, out.stderr.count("\n")), (code, 1), out.stderr)
            self.assertIn(words, out.stderr)


    def test_a_camera_that_is_not_there_is_exit_code_6(self):
        out = run("scan", "genicam:nobody", "-o", WORK / "x.pcd")
        if "not built in" in out.stderr:
            self.assertEqual(out.returncode, 2)
            self.assertIn("libaravis-dev", out.stderr)
            return
        self.assertEqual((out.returncode, out.stderr.count("\n")), (6, 1), out.stderr)
        self.assertIn("genicam:nobody", out.stderr)

    def test_shots_are_replayed_with_the_same_bytes(self):
        camera = {"cam_K": [200, 0, 79.5, 0, 200, 63.5, 0, 0, 1], "width": 160, "height": 128}
        (WORK / "small_camera.json").write_text(json.dumps(camera))
        box_stl(WORK / "block.stl", (30, 20, 12))
        cell = WORK / "cell.toml"
        text = ('[camera]\nfile = "small_camera.json"\nmount = "hand"\n[hand_eye]\nflange_from_camera = '
                '{translation_mm = [0, 0, 50]}\n[bin]\ninner_size_mm = [160, 120, 60]\n'
                '[[part]]\nname = "block"\ncad = "block.stl"\n')
        cell.write_text(text)
        pose = "yaskawa 0 0 500 180 0 0"
        shutil.rmtree(WORK / "shots", ignore_errors=True)
        shutil.rmtree(WORK / "cell_scenes", ignore_errors=True)
        out = run("scan", f"sim:{cell}", "--base-from-flange", pose, "-o", WORK / "taken.pcd", "--record", WORK / "shots")
        if "not built in" in out.stderr:
            self.skipTest("SKIPPED: no simulation")
        self.assertEqual(out.returncode, 0, out.stderr)
        out = run("scan", WORK / "shots", "-o", WORK / "again.pcd")
        self.assertEqual(out.returncode, 0, out.stderr)
        for ending in [".pcd", ".taken.json"]:
            self.assertEqual((WORK / ("taken" + ending)).read_bytes(), (WORK / ("again" + ending)).read_bytes())
        out = run("scan", WORK / "shots", "-o", WORK / "again.pcd", "--base-from-flange", pose, "--flange-time",
                  "2026-11-22T11:15:03.250Z")
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertIn("2026-11-22T11:15:03.250Z", (WORK / "again.taken.json").read_text())
        out = run("simulate", cell, "--base-from-flange", pose, "-o", WORK / "cell_scenes")
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertIn("kind bin", out.stdout)
        info = json.loads((WORK / "cell_scenes/scene_info.json").read_text())["1"]
        self.assertEqual(info["bin_inner_mm"], [160, 120, 60])
        for arguments, code, words in [
            (["scan", f"sim:{cell}", "-o", WORK / "x.pcd"], 3, "base_from_flange"),
            (["scan", f"sim:{WORK}/none.toml", "-o", WORK / "x.pcd"], 3, "none.toml"),
            (["scan", WORK / "shots", "-o", WORK / "x.pcd", "--report", WORK / "x"], 2, "--report"),
            (["scan", WORK / "shots", "-o", WORK / "x.pcd", "--base-from-flange", "kuka 1 2"], 2, "kuka"),
            (["scan", WORK / "shots", "-o", WORK / "x.pcd", "--taken", "today"], 2, "--taken"),
            (["simulate", cell, "--kind", "table", "-o", WORK / "x"], 3, "base_from_flange"),
            (["simulate", "-o", WORK / "x"], 2, "--part"),
        ]:
            out = run(*arguments)
            self.assertEqual((out.returncode, out.stderr.count("\n")), (code, 1), out.stderr)
            self.assertIn(words, out.stderr)


@unittest.skipUnless(SCENES.exists(), "SKIPPED: no shared data")
class LocateCommand(unittest.TestCase):
    scene = SCENES / "test/000001"
    arguments = ["locate", scene / "depth/000000.png", "--camera", scene / "scene_camera.json",
                 "--part", SCENES / "cad/alternator_a.stl", "--part", SCENES / "cad/alternator_b.stl", "--no-times"]

    def test_same_bytes_for_any_number_of_threads(self):
        one, two = (run(*self.arguments, "--json", "-", "--threads", n) for n in (1, 2))
        self.assertEqual((one.returncode, two.returncode), (0, 0), one.stderr)
        self.assertEqual(one.stdout, two.stdout)
        result = validated(self, "locate", one.stdout)
        self.assertEqual([i["part"] for i in result["instances"]], ["alternator_a"])

    def test_the_robot_server_gives_the_same_pose(self):
        cell = WORK / "server_cell.toml"
        point = 'part_from_tcp = {rotation_deg = {convention = "yaskawa", values = [%d, 0, 0]}}'
        cell.write_text(f"""[camera]
file = "{self.scene.resolve()}/scene_camera.json"
[hand_eye]
base_from_camera = {{translation_mm = [100, 200, 900], rotation_deg = {{convention = "yaskawa", values = [180, 0, 0]}}}}
[[part]]
name = "alternator_a"
cad = "{SCENES.resolve()}/cad/alternator_a.stl"
max_tilt_deg = 90
pick_points = [{{{point % 0}}}, {{{point % 180}}}]
[safety]
workspace_mm = {{min = [-5000, -5000, -5000], max = [5000, 5000, 5000]}}
scan_max_age_s = 100
""")
        found = json.loads(run(*self.arguments, "--json", "-").stdout)["instances"][0]
        x, y, z = found["camera_from_part"]["translation_mm"]
        with Served("robot-server", self.scene / "depth/000000.png", "--workcell", cell, "--port", 0, "--any-age") as served:
            self.assertNotEqual(served.port, 0, served.first)
            answer = served.talk("HELLO,1,kuka\r\nSCAN\r\nGET,3\r\nBYE\r\n", "202\r\n")
        lines = answer.split("\r\n")
        self.assertEqual(lines[:3], ["100,1,tribin", "201,1,1", "200,1,3,0"], answer)
        pose = [float(v) for v in lines[4].split(",")[4:]]
        for seen, wanted in zip(pose, (x + 100, 200 - y, 900 - z)):
            self.assertAlmostEqual(seen, wanted, delta=0.002)
        no_time = Served("robot-server", self.scene / "depth/000000.png", "--workcell", cell, "--port", 0)
        with no_time as served:  # motion goes by a scan whose age is known only
            self.assertIn("500,", served.talk("HELLO,1,kuka\r\nSCAN\r\nBYE\r\n", "202\r\n"))

    def test_grasps_have_their_paths_terms_and_reasons(self):
        cell = WORK / "grasps_cell.toml"
        cell.write_text(f"""[camera]
file = "{self.scene.resolve()}/scene_camera.json"
[hand_eye]
base_from_camera = {{translation_mm = [1000, 0, 900], rotation_deg = {{convention = "yaskawa", values = [180, 0, 0]}}}}
[[gripper]]
name = "jaw"
kind = "parallel_outside"
stroke_mm = [0, 150]
finger_mm = [12, 20, 110]
tip_mm = 5
flange_from_tcp = {{translation_mm = [0, 0, 185]}}
boxes = [{{center_mm = [0, 0, 35], size_mm = [90, 70, 70]}}]
[[part]]
name = "alternator_a"
cad = "{SCENES.resolve()}/cad/alternator_a.stl"
max_tilt_deg = 90
[[robot]]
model = "{ROOT.resolve()}/examples/robots/gp110.toml"
""")
        asked = ["grasps", self.scene / "depth/000000.png", "--workcell", cell, "--pushes", "--json", "-"]
        one, two = (run(*asked, "--threads", n) for n in (1, 2))
        self.assertEqual(one.returncode, 0, one.stderr)
        self.assertEqual(one.stdout, two.stdout)
        plan = validated(self, "grasps", one.stdout)
        self.assertEqual(plan["status"], "ok")
        scores = [grasp["score"] for grasp in plan["grasps"]]
        self.assertEqual(scores, sorted(scores, reverse=True))
        for grasp in plan["grasps"]:
            self.assertEqual(len(grasp["path"][0]["joints_deg"]), 6)
            self.assertEqual([p["step"] for p in grasp["path"]][-3:], ["pre_pick", "pick", "retreat"])
        self.assertEqual(sum(r["count"] for r in plan["reasons"]), len(plan["refused"]))
        # A robot's own program is given the best of them.
        with cell.open("a") as file:
            file.write("[safety]\nworkspace_mm = {min = [-5000, -5000, -5000], max = [5000, 5000, 5000]}\n")
        with Served("robot-server", self.scene / "depth/000000.png", "--workcell", cell, "--port", 0, "--any-age") as served:
            answer = served.talk("HELLO,1,yaskawa\r\nSCAN\r\nGET,3\r\nBYE\r\n", "202\r\n")
        lines = answer.split("\r\n")
        self.assertEqual(lines[1:3], ["201,1,1", "200,1,3,0"], answer)
        for line, point in zip(lines[3:6], plan["grasps"][0]["path"]):
            for seen, wanted in zip(line.split(",")[4:7], point["base_from_tcp"]["translation_mm"]):
                self.assertAlmostEqual(float(seen), wanted, delta=0.002)

    def test_a_kept_part_is_found_as_one_that_is_compiled_now(self):
        kept, compiled = run(*self.arguments, "--json", "-"), run(*self.arguments, "--json", "-", "--no-cache")
        self.assertEqual(kept.stdout, compiled.stdout)

    def test_the_report_holds_ten_figures_a_found_part(self):
        dir = WORK / "locate_report"
        shutil.rmtree(dir, ignore_errors=True)
        out = run(*self.arguments, "--report", dir, "--truth", self.scene / "scene_gt.json")
        self.assertEqual(out.returncode, 0, out.stderr)
        page = (dir / "index.html").read_text()
        self.assertLess((dir / "index.html").stat().st_size, 3_000_000)
        figures = page.count("<figure>")
        self.assertEqual(figures, 10 + 2, "ten of the part that is there, the CAD's two of the other")
        for forbidden in ("http://", "https://", "<script src"):
            self.assertFalse(forbidden in page, forbidden)
        validated(self, "locate", (dir / "report.json").read_text())
        rows = set(re.findall(r'<tr data-k="([^"]+)"', page))
        drawn = {key for keys in re.findall(r'<(?:path|circle)[^>]* data-k="([^"]+)"', page) for key in keys.split()}
        self.assertTrue(rows & drawn, "what is matched lights up in the pictures")
        from_scan = {key for key in drawn if key.startswith("s")}
        of_layers = [set(re.findall(r'data-k="(s[0-9]+)"', layer)) for layer in page.split('class="links"')[1:3]]
        self.assertTrue(from_scan and of_layers[0] & of_layers[1], "segmentation (f) and model (g) share their keys")

    def test_the_papers_method_says_what_each_candidate_was_judged_by(self):
        figures = WORK / "figures"
        shutil.rmtree(figures, ignore_errors=True)
        out = run(*self.arguments, "--method", "paper", "--json", "-")
        self.assertIn(out.returncode, (0, 1), out.stderr)
        result = validated(self, "locate", out.stdout)
        self.assertTrue(result["rejected"] or result["instances"])
        for instance in result["instances"]:
            self.assertTrue(all(e["tests"] for e in instance["evidence"]))
        drawn = run(*self.arguments, "--method", "paper", "--expert", "--figures", figures)
        with_plane = [i for i in result["instances"] if any(e["type"] == "plane" for e in i["evidence"])]
        self.assertEqual(drawn.returncode, 0 if with_plane else 4, drawn.stderr)
        for figure in sorted(figures.glob("*")) if with_plane else []:
            xml.etree.ElementTree.parse(figure)

    def test_a_file_is_there_whole_or_not_at_all_after_an_interrupt(self):
        target = WORK / "interrupted"
        shutil.rmtree(target, ignore_errors=True)
        target.mkdir()
        process = subprocess.Popen([TRIBIN, *map(str, self.arguments), "--json", target / "result.json", "--report", target / "report"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(0.15)
        process.send_signal(signal.SIGINT)
        code = process.wait(60)
        left = sorted(p.name for p in target.iterdir())
        self.assertIn(code, (0, 130, -signal.SIGINT))  # the last: it was still being loaded
        self.assertTrue(set(left) <= {"result.json", "report"}, left)


@unittest.skipUnless(SCENES.exists(), "SKIPPED: no shared data")
class SegmentCommand(unittest.TestCase):
    def test_json_and_labels(self):
        scene = SCENES / "test/000001"
        labels = WORK / "labels.png"
        out = run("segment", scene / "depth/000000.png", "--camera", scene / "scene_camera.json", "--json", "-", "--labels", labels)
        self.assertEqual(out.returncode, 0, out.stderr)
        result = validated(self, "segment", out.stdout)
        self.assertTrue(any(p["type"] == "cylinder" for p in result["primitives"]))
        self.assertEqual(labels.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")


class CalibrateCommand(unittest.TestCase):
    poses = ROOT / "examples/calibration/hand_eye_poses.json"
    points = ROOT / "examples/calibration/touched_points.json"

    def changed(self, source, change):
        document = json.loads(source.read_text())
        change(document)
        path = WORK / "changed.json"
        path.write_text(json.dumps(document))
        return path

    def test_hand_eye_names_what_is_wrong_with_the_example(self):
        out = run("calibrate", "hand-eye", self.poses, "--json", "-")
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertIn("'4' and '11' are swapped", out.stderr)
        result = validated(self, "hand_eye", out.stdout)
        self.assertEqual((result["swapped"], result["outliers"]), ([["4", "11"]], ["4", "8", "11"]))
        for found, truth in zip(result["base_from_camera"]["translation_mm"], (700, 100, 1300)):
            self.assertLess(abs(found - truth), 1)
        self.assertEqual(out.stdout, run("calibrate", "hand-eye", self.poses, "--json", "-").stdout)

    def test_hand_eye_pairs_by_id_not_by_order(self):
        shuffled = self.changed(self.poses, lambda d: (d["robot"].reverse(), d["camera"].pop(2)))
        result = json.loads(run("calibrate", "hand-eye", shuffled, "--json", "-").stdout)
        self.assertEqual(sum(map(len, result["unpaired"].values())), 1)
        self.assertLessEqual({"4", "8", "11"} - set(result["unpaired"]["robot"]), set(result["outliers"]))

    def test_touch_is_stamped_with_the_day(self):
        out = run("calibrate", "touch", self.points, "--json", "-")
        result = validated(self, "touch", out.stdout)
        self.assertEqual((out.returncode, result["date"], len(result["points"])), (0, "2026-03-05", 10))
        self.assertIn("rigid_error", [w["code"] for w in result["warnings"]])
        self.assertEqual(json.loads(run("calibrate", "touch", self.points, "--date", "2024-02-29", "--json", "-").stdout)["date"],
                         "2024-02-29")
        undated = self.changed(self.points, lambda d: d.pop("date"))
        before = time.strftime("%Y-%m-%d", time.gmtime())
        stamped = json.loads(run("calibrate", "touch", undated, "--json", "-").stdout)["date"]
        self.assertIn(stamped, (before, time.strftime("%Y-%m-%d", time.gmtime())))

    def test_bad_input_is_one_sentence_with_its_code(self):
        def pose(d): d["robot"][3]["pose"].pop()
        def brand(d): d.update(convention="acme")
        def twice(d): d["camera"][1]["id"] = d["camera"][0]["id"]
        def few(d): d.update(camera=d["camera"][:2])
        def metres(d):
            for r in d["robot"]: r["pose"][:3] = [x / 1000 for x in r["pose"][:3]]
        def matrix(d): d["camera"][0].pop("rotation_vector_rad"); d["camera"][0]["rotation"] = [[1, 0, 0], [0, 2, 0], [0, 0, 1]]
        def mount(d): d.pop("mount")
        def misspelt(d): d["robot"][0]["possse"] = 1
        def parallel(d):
            for r in d["robot"]: r["pose"][3:5] = [180, 0]
        for change, code, words in [(pose, 3, "robot[3].pose"), (brand, 3, "kawasaki"), (twice, 3, "camera[1].id"),
                                    (few, 4, "saw 2 pairs"), (metres, 5, "robot_unit"), (matrix, 3, "camera[0].rotation"),
                                    (mount, 2, "--mount"), (misspelt, 3, "possse"), (parallel, 4, "parallel axes")]:
            out = run("calibrate", "hand-eye", self.changed(self.poses, change))
            self.assertEqual((out.returncode, out.stderr.count("\n")), (code, 1), out.stderr)
            self.assertIn(words, out.stderr)
            self.assertIn("calibrate hand-eye: ", out.stderr)
            self.assertIn("changed.json", out.stderr)
        def day(d): d.update(date="2026-02-30")
        def line(d):
            for i, p in enumerate(d["points"]): p["predicted_mm"] = [600 + 10 * i, 0, 0]
        for change, code, words in [(day, 3, "date"), (line, 4, "one line"), (lambda d: d["points"][2].pop("touched_mm"), 3, "points[2]")]:
            out = run("calibrate", "touch", self.changed(self.points, change))
            self.assertEqual((out.returncode, out.stderr.count("\n")), (code, 1), out.stderr)
            self.assertIn(words, out.stderr)
        self.assertEqual(run("calibrate", "touch", self.points, "--date", "yesterday").returncode, 2)
        self.assertEqual(run("calibrate").returncode, 2)
        self.assertEqual(run("calibrate", "hand-eye", self.poses, "--mount", "hand").returncode, 2)


if __name__ == "__main__":
    WORK.mkdir(parents=True, exist_ok=True)
    unittest.main(argv=sys.argv[:1], verbosity=2)
