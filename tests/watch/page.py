"""Tries the page of softvt watch in Chromium: python page.py SOFTVT CHROMIUM SCREENSHOTS."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

# WebGL without a graphics card, also for root.
FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
# Longest wait for an episode, ms.
PATIENCE = 120_000


def wait_for(page: Page, kind: str) -> None:
    """Waits for a message of the feed of this type."""
    page.wait_for_selector(f"body[data-state={kind}]", timeout=PATIENCE)


def watch_episode(page: Page) -> None:
    """Waits for the end of the episode that was asked for."""
    wait_for(page, "state")
    wait_for(page, "end")


def seek(page: Page, share: float) -> None:
    """Shows the state at a share of the episode."""
    page.locator("#time").evaluate(
        "(slider, share) => { slider.value = Math.round(share * slider.max); slider.dispatchEvent(new Event('input')); }",
        share,
    )


def colours(page: Page) -> list[int]:
    """Number of red and of other pixels of the scene, of those that the object may have."""
    return page.evaluate(
        """() => {
            const scene = document.getElementById("scene"), copy = document.createElement("canvas");
            [copy.width, copy.height] = [scene.width, scene.height];
            const g = copy.getContext("2d");
            g.drawImage(scene, 0, 0);
            const { data } = g.getImageData(0, 0, copy.width, copy.height);
            let red = 0, lit = 0;
            for (let i = 0; i < data.length; i += 4) {
                if (data[i] > 110 && data[i + 1] < 70 && data[i + 2] < 70) red += 1;
                if (data[i] + data[i + 1] + data[i + 2] > 60) lit += 1;
            }
            return [red, lit];
        }"""
    )


def try_page(page: Page, script: Path, pictures: Path) -> None:
    """Plays episodes, looks at them, saves the script, drives the arm."""
    # The first episode is in the page from its first state on.
    wait_for(page, "end")
    expect(page.locator("#prompt")).to_contain_text("steamed-bun")
    seek(page, 0.55)
    page.select_option("#camera", "target")
    page.select_option("#skin", "strain")
    page.check("#clear")
    page.wait_for_timeout(300)
    page.screenshot(path=pictures / "safe.png")
    safe, lit = colours(page)
    assert lit > 50_000, "the scene is drawn"
    expect(page.locator("#badge")).to_have_class("safe")
    step = page.locator("#clock").inner_text()
    page.click("#forward")
    assert page.locator("#clock").inner_text() != step
    page.keyboard.press("ArrowLeft")

    # The same object, crushed.
    page.select_option("#policy", "expert-binary")
    watch_episode(page)
    seek(page, 0.55)
    page.wait_for_timeout(300)
    page.screenshot(path=pictures / "crushed.png")
    crushed, _ = colours(page)
    assert crushed > 2 * safe + 5_000, f"{crushed} red pixels of a crushed object, {safe} of a safe one"
    expect(page.locator("#badge")).to_have_class("harm")
    expect(page.locator("#badge")).to_contain_text("crushed")

    # A file saved half-way, and then whole.
    text = script.read_text()
    script.write_text(text[: len(text) // 2])
    wait_for(page, "error")
    expect(page.locator("#error")).to_contain_text(f"{script.name}:")
    page.screenshot(path=pictures / "error.png")
    script.write_text(text + "\n")
    watch_episode(page)
    expect(page.locator("#error")).to_be_hidden()

    # Down and closing, by keys.
    page.select_option("#policy", "teleop")
    wait_for(page, "state")
    expect(page.locator("#keys")).to_be_visible()
    page.select_option("#camera", "free")
    page.locator("#scene").click()
    page.keyboard.down("f")
    page.keyboard.down("c")
    # A busy machine simulates slowly.
    for _ in range(100):
        page.wait_for_timeout(200)
        width = float(re.findall(r"[0-9.]+", page.locator("#width-value").inner_text())[0])
        if width < 75:
            break
    page.keyboard.up("f")
    page.keyboard.up("c")
    page.screenshot(path=pictures / "teleop.png")
    assert width < 75, f"the gripper has not closed: {width} mm"

    page.set_viewport_size({"width": 400, "height": 800})
    page.screenshot(path=pictures / "narrow.png", full_page=True)
    overflow = page.evaluate("document.documentElement.scrollWidth - innerWidth")
    assert overflow <= 0, f"the page is {overflow} px wider than a telephone"


def main() -> None:
    """Starts the page of a copy of a suite, and tries it."""
    softvt, chromium, pictures = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    with tempfile.TemporaryDirectory() as home:
        script = Path(home) / "object_soft.lua"
        shutil.copy("suites/object_soft.lua", script)
        command = [softvt, "watch", script.name, "--task", "0"]
        with subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True) as server:
            try:
                url = server.stdout.readline().strip()
                with sync_playwright() as playwright:
                    browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
                    page = browser.new_page(viewport={"width": 1400, "height": 850}, bypass_csp=True)
                    problems = []
                    page.on("pageerror", lambda error: problems.append(str(error)))
                    page.on("console", lambda m: problems.append(m.text) if m.type == "error" else None)
                    page.goto(url)
                    try_page(page, script, pictures)
                    assert not problems, problems
                    browser.close()
            finally:
                server.terminate()
    print("the page was watched, clicked and driven")


if __name__ == "__main__":
    main()
