"""Write the reference pages from the declarations: ``python docs/build.py``."""

from __future__ import annotations

from pathlib import Path

from urban_processing.algorithms import specs
from urban_processing.algorithms.reference import algorithm_page, layout_file_page


def pages() -> dict[str, str]:
    """Return the text of each generated page by file name."""
    return {f"{spec.name}.md": algorithm_page(spec) for spec in specs()} | {
        "layout_file.md": layout_file_page()
    }


if __name__ == "__main__":
    for name, text in pages().items():
        Path(__file__).with_name(name).write_text(text, encoding="utf-8")
