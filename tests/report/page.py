"""Opens pages of softvt report in Chromium: python page.py CHROMIUM AXE SCREENSHOTS PAGE..."""

import sys
from pathlib import Path

from playwright.sync_api import Browser, ConsoleMessage, Page, sync_playwright

# Names, widths and colour schemes of the windows.
WINDOWS = [("1400", 1400, "light"), ("800", 800, "light"), ("400", 400, "light"), ("dark", 1400, "dark")]
# Largest size of a page with stills, bytes.
MAX_BYTES = 500_000


def violations(page: Page, axe: Path) -> list[str]:
    """What axe-core finds, with every folded part open."""
    page.evaluate("document.querySelectorAll('details').forEach((details) => { details.open = true; })")
    page.add_script_tag(path=axe)
    found = page.evaluate("axe.run().then((results) => results.violations)")
    return [f"{violation['id']}: {violation['nodes'][0]['html']}" for violation in found]


def open_page(browser: Browser, file: Path, axe: Path, pictures: Path) -> list[str]:
    """Problems of a page in any window."""
    problems: list[str] = []
    name = file.parent.name

    def note(message: ConsoleMessage) -> None:
        problems.append(message.text)

    for window, width, scheme in WINDOWS:
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        page.on("console", note)
        page.goto(file.as_uri())
        page.screenshot(path=pictures / f"{name}-{window}.png", full_page=True)
        where = f"{name} at {window}"
        overflow = page.evaluate("document.documentElement.scrollWidth - innerWidth")
        if overflow > 0:
            problems.append(f"{where}: the page is {overflow} px wider than the window")
        cut = page.evaluate("[...document.querySelectorAll('figcaption')].some((c) => c.scrollWidth > c.clientWidth + 1)")
        if cut:
            problems.append(f"{where}: a caption is cut off")
        problems += [f"{where}: {violation}" for violation in violations(page, axe)]
        page.close()
    page = browser.new_page()
    page.goto(file.as_uri())
    page.pdf(path=pictures / f"{name}-print.pdf", prefer_css_page_size=True, print_background=True)
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 1030, "height": 700})
    page.screenshot(path=pictures / f"{name}-print.png", full_page=True)
    page.close()
    if file.stat().st_size > MAX_BYTES:
        problems.append(f"{name}: {file.stat().st_size} bytes")
    return problems


def main() -> None:
    """Opens all pages."""
    chromium, axe, pictures, *files = sys.argv[1:]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        problems = []
        for file in files:
            problems += open_page(browser, Path(file).resolve(), Path(axe), Path(pictures))
        browser.close()
    assert not problems, "\n".join(problems)
    print(f"{len(files)} pages were opened in {len(WINDOWS)} windows and printed")


if __name__ == "__main__":
    main()
