"""Tables and pages, and the numbers in them."""
import csv
import dataclasses
import math
import statistics


@dataclasses.dataclass
class Table:
    name: str
    title: str
    columns: list
    rows: list
    marks: set = dataclasses.field(default_factory=set)  # (row, column) that the page, not the CSV, marks with `!`

    def markdown(self):
        cells = [self.columns] + [[f"{cell} !" if (i, j) in self.marks else str(cell) for j, cell in enumerate(row)]
                                  for i, row in enumerate(self.rows)]
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.columns))]
        lines = ["| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths)) + " |" for row in cells]
        lines.insert(1, "| " + " | ".join("-" * width for width in widths) + " |")
        return "\n".join(lines)


def fixed(value, decimals, sign=False):
    return "" if value is None or math.isnan(value) else f"{value:{'+' if sign else ''}.{decimals}f}"


def mean(values):
    return statistics.fmean(values) if values else math.nan


def median(values):
    return statistics.median(values) if values else math.nan


def spread(values):
    return statistics.stdev(values) if len(values) > 1 else math.nan


@dataclasses.dataclass
class Page:
    """What an experiment leaves: facts, tables and figures."""
    title: str
    notes: list = dataclasses.field(default_factory=list)
    tables: list = dataclasses.field(default_factory=list)
    figures: list = dataclasses.field(default_factory=list)  # (figure, name of its file)
    conclusion: str = ""  # the last line

    def write(self, folder, name, command):
        notes = self.notes + [f"command: `{command}`"]
        text = [f"# {self.title}", "\n".join(f"- {note}" for note in notes)]
        for table in self.tables:
            text += [f"## {table.title}", table.markdown()]
            with open(folder / f"{table.name}.csv", "w", newline="") as file:
                file.writelines(f"# {note}\n" for note in notes)
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(table.columns)
                writer.writerows(table.rows)
        for figure, file_name in self.figures:
            figure.savefig(folder / file_name, dpi=120, bbox_inches="tight")
            text.append(f"![{file_name}]({file_name})")
        if self.conclusion:
            text.append(self.conclusion)
        (folder / f"{name}.md").write_text("\n\n".join(text) + "\n")
        shown = [table for table in self.tables if not table.name.endswith("_runs")]
        print("\n\n".join(f"{table.title}\n{table.markdown()}" for table in shown))
        files = [f"{name}.md"] + [f"{table.name}.csv" for table in self.tables] + [file for _, file in self.figures]
        print(f"\nin {folder}: {', '.join(files)}")
        if self.conclusion:
            print(self.conclusion)
