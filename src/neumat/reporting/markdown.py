"""Tables as Markdown."""

import pandas as pd


def frame_markdown(frame):
    """Return a data frame as a Markdown table: four significant digits, and nothing where there is no value."""
    rows = [frame.columns, ["---"] * frame.shape[1], *([_cell(value) for value in row] for row in frame.to_numpy())]
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in rows)


def _cell(value):
    if pd.isna(value):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value).replace("|", "\\|")
