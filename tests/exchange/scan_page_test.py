"""The page of a scan and the exported page, in a real browser."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest
from urllib.request import Request, urlopen

try:
    from selenium import webdriver
    from selenium.common.exceptions import ElementNotInteractableException, JavascriptException
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.select import Select
except ImportError:
    webdriver = None
if webdriver is None or not shutil.which("chromedriver"):
    print("skipped: no chromium-driver and python3-selenium")
    sys.exit(77)

PROGRAM = os.environ["GELSLAM_PROGRAM"]
WORK = pathlib.Path(os.environ["GELSLAM_WORK"])
TRIANGLES = "return [...parts.values()].reduce((sum, part) => sum + part.count / 3, 0)"


def open_browser(*words):
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for word in ("--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
                 "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1280,800", *words):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.chrome.service.Service(shutil.which("chromedriver"))
    return webdriver.Chrome(service=driver, options=options)


class SimulatedCamera(unittest.TestCase):
    def scan(self, folder, *options):
        shutil.rmtree(WORK / folder, ignore_errors=True)
        program = subprocess.Popen([PROGRAM, "scan", "--camera", "simulated", "--headless", "-o", WORK / folder, *options],
                                   stderr=subprocess.PIPE, text=True, env={**os.environ, "XDG_CACHE_HOME": str(WORK / "cache")})
        self.addCleanup(program.stderr.close)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        return program

    def test_begins_one_scan_after_another_and_records_each(self):
        for number in (2, 3):
            shutil.rmtree(WORK / f"again-{number}", ignore_errors=True)
        program = self.scan("again", "--serve", "0")
        address, token = program.stderr.readline().removeprefix("serving ").strip().split("?")
        for folder in ("again", "again-2", "again-3"):
            for _ in range(300):
                status = json.load(urlopen(f"{address}status?{token}"))
                if status.get("run_folder", "").endswith(folder) and status["state"] == "tracking":
                    break
                time.sleep(0.1)
            else:
                self.fail(f"{folder} tracks nothing: {status}")
            word = "stop" if folder == "again-3" else "new"
            urlopen(Request(f"{address}{word}?{token}", method="POST"))
        self.assertEqual(program.wait(timeout=60), 0)
        done = subprocess.run([PROGRAM, "reconstruct", WORK / "again-3/log.mkv", "-o", WORK / "again-offline", "--overwrite"])
        self.assertEqual(done.returncode, 0)

    def test_ctrl_c_between_two_scans_ends_the_program(self):
        for wait_s in (0.0, 0.2, 0.5):
            shutil.rmtree(WORK / "between-2", ignore_errors=True)
            program = self.scan("between", "--serve", "0")
            address, token = program.stderr.readline().removeprefix("serving ").strip().split("?")
            time.sleep(2)
            urlopen(Request(f"{address}new?{token}", method="POST"))
            time.sleep(wait_s)
            program.send_signal(signal.SIGINT)
            self.assertIn(program.wait(timeout=10), (0, 1), "1: nothing was touched")

    def test_an_end_without_a_touch_is_no_success(self):
        program = self.scan("untouched", "--seconds", "0.3")
        said = program.communicate(timeout=60)[1]
        self.assertEqual(program.returncode, 1)
        self.assertIn("warning: nothing was touched", said)


class Pages(unittest.TestCase):
    def setUp(self):
        self.open()

    def open(self, *words):
        self.browser = open_browser(*words)
        self.addCleanup(self.browser.quit)

    def tearDown(self):
        said = [entry["message"] for entry in self.browser.get_log("browser") if entry["level"] == "SEVERE"]
        self.assertEqual([message for message in said if "net::ERR_" not in message], [], "the page's errors")

    def wait(self, condition, what):
        """What the condition gives, once it is something. A page that loads, or waits for the program, may lack what it asks for."""
        for _ in range(600):
            problem = ""
            try:
                found = condition()
                if found:
                    return found
            except (ElementNotInteractableException, JavascriptException) as error:
                problem = f": {error.msg}"
            time.sleep(0.1)
        self.fail("did not happen: " + what + problem)

    def value(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def text(self, name):
        return self.browser.find_element(By.ID, name).text

    def click(self, name):
        self.wait(lambda: not self.browser.find_element(By.ID, name).click(), f"a click on {name}")

    def drawn(self):
        """The share of the view that shows something, of a picture drawn anew."""
        return self.value("""draw();
            const kinds = new Uint8Array(4 * view.width * view.height), shade = background.map(level => 255 * level);
            gl.readPixels(0, 0, view.width, view.height, gl.RGBA, gl.UNSIGNED_BYTE, kinds);
            let seen = 0;
            for (let i = 0; i < kinds.length; i += 4) if (Math.abs(kinds[i] - shade[0]) + Math.abs(kinds[i + 1] - shade[1]) > 20) ++seen;
            return seen / (view.width * view.height);""")

    def look_at_colors(self):
        """Each draws another picture of the same surface, with a legend."""
        pictures = {}
        for color in ("height", "confidence", "curvature", "plain"):
            Select(self.browser.find_element(By.ID, "color")).select_by_value(color)
            pictures[color] = self.value("""draw();
                const kinds = new Uint8Array(4 * view.width * view.height);
                gl.readPixels(0, 0, view.width, view.height, gl.RGBA, gl.UNSIGNED_BYTE, kinds);
                return kinds.reduce((sum, level, i) => sum + level * (i % 4 + 1), 0) + by("low").textContent""")
            self.assertEqual(self.browser.find_element(By.ID, "legend").is_displayed(), color != "plain")
        self.assertEqual(len(set(pictures.values())), 4, pictures)

    def all_is_in_sight(self, *names):
        """Without scrolling."""
        for name in names:
            place = self.value("const box = by(arguments[0]).getBoundingClientRect(); return [box.top, box.bottom, box.left, box.right]", name)
            self.assertGreaterEqual(min(place), 0, name)
            self.assertLessEqual(place[1], self.value("return innerHeight"), name)
            self.assertLessEqual(place[3], self.value("return innerWidth"), name)

    def scan(self, *options):
        """A scan by a simulated camera; its address."""
        environment = {**os.environ, "XDG_CACHE_HOME": str(WORK / "cache")}
        for folder in ("served", "served-2"):  # logs are not overwritten
            shutil.rmtree(WORK / folder, ignore_errors=True)
        self.program = subprocess.Popen(
            [PROGRAM, "scan", "--camera", "simulated", "--headless", "-o", WORK / "served", "--serve", *options],
            stderr=subprocess.PIPE, text=True, env=environment)
        self.addCleanup(self.program.stderr.close)
        self.addCleanup(self.program.wait)
        self.addCleanup(self.program.kill)
        return self.program.stderr.readline().removeprefix("serving ").strip()

    def test_a_scan(self):
        address = self.scan("0")
        self.browser.get(address)
        first = self.wait(lambda: self.value(TRIANGLES), "the surface appears")
        self.wait(lambda: self.value(TRIANGLES) > 1.5 * first, "the surface grows")
        self.assertGreater(self.drawn(), 0.005)
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                     {"width": 1280, "height": 657, "deviceScaleFactor": 1, "mobile": False})
        self.all_is_in_sight("stop", "new", "all", "help", "color", "path", "size", "picture", "figures", "files")
        self.wait(lambda: self.value("return pictured >= 0 && by('picture').getContext('2d').getImageData(5, 5, 1, 1).data[3] === 255"),
                  "the camera's picture")
        self.wait(lambda: re.fullmatch(r"\d+ kB/s, pictures at \d+ Hz", self.text("rate")), "the rate")
        self.wait(lambda: self.value("return lines.has('way') && lines.has('keyframes')"), "the trajectory")
        self.assertRegex(self.text("size"), r"^Size: [\d.]+ × [\d.]+ × [\d.]+ mm$")
        self.look_at_colors()
        self.click("help")
        self.assertIn("hollows dark", self.text("explained"))
        self.browser.find_element(By.CSS_SELECTOR, "#explained button").click()

        self.browser.refresh()
        self.wait(lambda: self.value(TRIANGLES) > first, "the surface after a reload")
        self.browser.switch_to.new_window("tab")
        self.browser.get(address)
        self.wait(lambda: self.value(TRIANGLES) > first, "the surface in a second tab")
        self.browser.close()
        self.browser.switch_to.window(self.browser.window_handles[0])

        self.click("stop")
        self.assertIn("saved in", self.text("means"))
        self.click("no")
        self.assertEqual(self.value("return state.phase"), "scanning", "asks before it ends a scan")

        self.click("new")
        self.click("yes")
        self.wait(lambda: self.value("return state.run_folder || ''").endswith("served-2"), "the next scan")
        self.wait(lambda: self.value(TRIANGLES) > 0, "its surface")
        self.assertTrue((WORK / "served/report.json").exists())
        self.click("stop")
        self.click("yes")
        self.wait(lambda: self.text("headline") == "Finished", "the end")
        self.assertEqual(self.program.wait(timeout=60), 0)
        self.wait(lambda: "The program has ended." in self.text("advice"), "that it has ended")
        self.assertEqual(self.text("headline"), "Finished")
        report = json.loads((WORK / "served-2/report.json").read_text())
        self.assertEqual(self.value(TRIANGLES), report["mesh"]["triangles"], "the final mesh stays")
        self.assertIn("Size: ", self.text("size"))
        for name in ("stop", "new"):
            self.assertFalse(self.browser.find_element(By.ID, name).is_displayed(), name + " leads nowhere")
        self.assertTrue(self.browser.find_element(By.ID, "files").is_displayed(), "can still be saved")
        for name, first in (("ply", "ply\n"), ("glb", "glTF")):
            self.assertEqual(self.browser.execute_async_script(
                f"fetch(by('{name}').href).then(reply => reply.text()).then(text => arguments[0](text.slice(0, 4)))"),
                first, name)
        self.look_at_colors()

    def test_a_phone_with_a_token(self):
        address = self.scan("0.0.0.0:0", "--token", "phonephone")
        self.assertRegex(address, r"^http://[0-9.]+:[0-9]+/\?token=phonephone$")
        with self.assertRaisesRegex(OSError, "403"):
            urlopen(address.replace("phonephone", "phonephon"))
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                     {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True})
        self.browser.get(address)
        self.wait(lambda: self.value(TRIANGLES), "the surface")
        self.all_is_in_sight("stop", "new", "all", "help", "color", "path", "size", "picture")
        self.assertLessEqual(self.value("return document.documentElement.scrollWidth"), 390)
        self.assertGreater(self.value("return by('view').clientHeight"), 844 / 2)
        self.value("window.graphics = gl.getExtension('WEBGL_lose_context'); graphics.loseContext()")
        self.value("graphics.restoreContext()")
        self.wait(lambda: not self.value("return window.graphics") and self.value(TRIANGLES), "the surface when the graphics are back")
        self.program.kill()
        self.wait(lambda: self.text("headline") == "Connection lost", "that the program is gone")

    def test_a_browser_without_webgl(self):
        self.open("--disable-3d-apis")
        self.browser.get(self.scan("0"))
        self.assertIn("no WebGL", self.text("stage"))
        self.wait(lambda: self.value("return pictured >= 0 && by('picture').getContext('2d').getImageData(5, 5, 1, 1).data[3] === 255"),
                  "the camera's picture")
        self.wait(lambda: self.value("return state.touch && by('figures').childElementCount"), "the figures")
        self.click("stop")
        self.click("yes")
        self.wait(lambda: self.text("headline") == "Finished", "the end")

    def test_the_exported_page(self):
        subprocess.run([PROGRAM, "export", WORK / "run", "-o", WORK / "page.html", "--overwrite", "-q"], check=True)
        self.browser.get((WORK / "page.html").as_uri())
        self.assertGreater(self.value(TRIANGLES), 1000)
        self.assertGreater(self.drawn(), 0.03)
        pictures = [self.browser.get_screenshot_as_png()]
        self.look_at_colors()
        self.click("path")
        pictures.append(self.browser.get_screenshot_as_png())
        self.assertEqual(len(set(pictures)), 2, "the way is drawn")
        self.assertIn("Size: ", self.text("size"))


if __name__ == "__main__":
    unittest.main()
