"""The table of a study as a spreadsheet opens it."""

import csv

from scenarios.campaign.table import write_csv


def test_no_name_is_a_formula(tmp_path):
    file = tmp_path / "results.csv"
    rows = [{"neck": '=HYPERLINK("x")', "status": "whole", "n": -1.5}, {"neck": "+A38", "n": 2}]
    write_csv(rows, file)
    with file.open(newline="", encoding="utf-8") as stream:
        table = list(csv.reader(stream))
    assert table == [
        ["neck", "status", "n"],
        ['\'=HYPERLINK("x")', "whole", "-1.5"],
        ["'+A38", "", "2"],
    ]
