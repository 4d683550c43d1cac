"""Files of a model in the studio: a dropped table, and a Python function that is trusted."""

from __future__ import annotations

from collections.abc import Callable

from building import double_click
from playwright.sync_api import Page, expect

from conftest import Studio

DROP = """async ({ name, text }) => {
  const transfer = new DataTransfer()
  transfer.items.add(new File([text], name))
  const sheet = document.querySelector('.canvas')
  const { x, y, width } = sheet.getBoundingClientRect()
  const at = { clientX: x + width / 2, clientY: y + 40 }
  for (const kind of ['dragenter', 'dragover', 'drop'])
    sheet.dispatchEvent(
      new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: transfer, ...at }))
}"""


def test_a_dropped_table_and_a_trusted_function(studio: Studio, open_studio: Callable[[str], Page]) -> None:
    page = open_studio("van_der_pol_pid")
    dialog = page.get_by_role("dialog")
    page.evaluate(DROP, {"name": "drive.csv", "text": "time [ms];x;y;note\n0;1,5;3;a\n10;2,5;4;b\n"})
    expect(dialog.get_by_label("note (text)")).to_be_disabled()
    expect(dialog.get_by_text("2 rows from 0 s to 0.01 s")).to_be_visible()
    dialog.get_by_label("y", exact=True).uncheck()
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(dialog).to_be_hidden()
    assert (studio.folder / "drive.csv").read_text().startswith("time [ms];x")
    page.evaluate(DROP, {"name": "drive.csv", "text": "time,x\n0,1\n1,2\n"})
    dialog.get_by_role("button", name="Use the present file").click()
    expect(dialog.get_by_label("y", exact=True)).to_be_checked()
    dialog.get_by_role("button", name="Cancel").click()

    (studio.folder / "law.py").write_text("def law(u, v):\n    return u * v\n")
    page.keyboard.press("Control+k")
    page.keyboard.type("Add a block")
    page.keyboard.press("Enter")
    page.get_by_placeholder("Add a block: type its name").fill("Python Function")
    page.keyboard.press("Enter")
    block = page.locator(".react-flow__node", has_text="Python Function")
    double_click(block)
    dialog.get_by_placeholder("Choose a file").fill("law")
    page.get_by_role("option", name="law.py").click()
    expect(dialog.get_by_label("Source of law.py")).to_contain_text("return u * v")
    dialog.get_by_role("button", name="Trust this code").click()
    expect(dialog.get_by_text("Revoke trust")).to_be_visible()
    dialog.get_by_role("button", name="OK", exact=True).click()
    expect(block.locator(".port.target")).to_have_count(2)
