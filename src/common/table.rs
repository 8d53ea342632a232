//! Tables of results: columns of cells, as plain text here, and as Markdown, LaTeX and HTML in `report`.

use super::text::shortened;

/// Columns between the columns of a table with widths, and of one that fits its cells.
const GAPS: [&str; 2] = [" ", "  "];
/// Longest cell of a column without a width, characters. The widths of format strings end at 65,535.
const MAX_CELL: usize = 160;

/// A column of a table of rows of type `T`.
pub struct Column<'a, T: ?Sized> {
    heading: Heading,
    cell: Box<dyn Fn(&T) -> String + 'a>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heading {
    pub text: String,
    /// True if its cells are aligned on the right, as numbers are.
    pub is_number: bool,
    /// Width in plain text, characters; as wide as the longest cell without one. Words are [shortened] to it; a number
    /// that is wider shifts the cells after it.
    pub width: Option<usize>,
}

impl<'a, T: ?Sized> Column<'a, T> {
    pub fn text(heading: impl Into<String>, cell: impl Fn(&T) -> String + 'a) -> Self {
        let heading = Heading { text: heading.into(), ..Heading::default() };
        Self { heading, cell: Box::new(cell) }
    }

    pub fn number(heading: impl Into<String>, cell: impl Fn(&T) -> String + 'a) -> Self {
        let column = Self::text(heading, cell);
        Self { heading: Heading { is_number: true, ..column.heading }, ..column }
    }

    /// The column with a width in plain text, characters.
    pub fn width(mut self, width: usize) -> Self {
        self.heading.width = Some(width);
        self
    }
}

/// A table of text cells.
///
/// ```
/// use softvt_common::table::{Column, Table};
///
/// let rows = [("cup", 1.25), ("bun", 0.5)];
/// let task = Column::text("task", |(task, _): &(&str, f64)| (*task).to_owned());
/// let d = Column::number("D, %", |(_, d): &(&str, f64)| format!("{d:.2}"));
/// assert_eq!(Table::new(&rows, [task, d]).text(), "task  D, %\ncup   1.25\nbun   0.50\n");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Meaning of the numbers, above or below the table.
    pub caption: String,
    pub columns: Vec<Heading>,
    /// Rows, as long as there are columns; in plain text they may be shorter.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new<'r, T: ?Sized + 'r>(
        rows: impl IntoIterator<Item = &'r T>,
        columns: impl IntoIterator<Item = Column<'r, T>>,
    ) -> Self {
        let columns: Vec<Column<T>> = columns.into_iter().collect();
        let cells = |row: &T| columns.iter().map(|column| (column.cell)(row)).collect();
        Self {
            caption: String::new(),
            rows: rows.into_iter().map(cells).collect(),
            columns: columns.into_iter().map(|column| column.heading).collect(),
        }
    }

    pub fn with_caption(self, caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..self }
    }

    /// The headings and the rows as lines of plain text without spaces at their ends.
    pub fn lines(&self) -> Vec<String> {
        let longest = |at: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(at)).chain([&self.columns[at].text]);
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0).min(MAX_CELL)
        };
        let widths: Vec<usize> = (self.columns.iter().enumerate())
            .map(|(at, column)| column.width.unwrap_or_else(|| longest(at)))
            .collect();
        let gap = GAPS[usize::from(self.columns.iter().all(|column| column.width.is_none()))];
        let cell = |(column, (width, cell)): (&Heading, (&usize, &String))| match column {
            Heading { is_number: true, width: Some(_), .. } => format!("{cell:>width$}"),
            Heading { is_number: true, .. } => format!("{:>width$}", shortened(cell, *width)),
            Heading { .. } => format!("{:<width$}", shortened(cell, *width)),
        };
        let line = |cells: &Vec<String>| {
            let cells: Vec<String> = self.columns.iter().zip(widths.iter().zip(cells)).map(cell).collect();
            cells.join(gap).trim_end().to_owned()
        };
        let headings = self.columns.iter().map(|column| column.text.clone()).collect();
        std::iter::once(&headings).chain(&self.rows).map(line).collect()
    }

    pub fn text(&self) -> String {
        self.lines().iter().flat_map(|line| [line.as_str(), "\n"]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_longest_cell_or_as_they_are_told() {
        let name = || Column::text("a", |row: &[&str; 2]| row[0].to_owned());
        let number = || Column::number("number", |row: &[&str; 2]| row[1].to_owned());
        let long = "x".repeat(70_000);
        let rows = [["long\nname", "1"], ["b", "12345678"]];
        assert_eq!(
            Table::new(&rows, [name(), number()]).text(),
            "a            number\nlong name         1\nb          12345678\n"
        );
        let fixed = Table::new(&rows, [name().width(5), number()]).text();
        assert_eq!(fixed, "a       number\nlong…        1\nb     12345678\n");
        let wide = Table::new(&[[long.as_str(), "1"]], [name(), number()]).text();
        assert!(wide.lines().all(|line| line.chars().count() <= 160 + 2 + 6), "{}", wide.len());
    }
}
