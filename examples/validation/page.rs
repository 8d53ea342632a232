//! Headings, tables and the summary of the page.

/// Prints a row of a table, whose cells are separated by bars.
macro_rules! row {
    ($($cells:tt)*) => {
        println!("| {} |", format_args!($($cells)*))
    };
}

/// A result and its bound, if it has one.
struct Claim {
    what: String,
    worst: f64,
    bound: Option<f64>,
}

#[derive(Default)]
pub struct Report {
    claims: Vec<Claim>,
}

impl Report {
    /// Records the worst of `values` (by magnitude) against a bound.
    pub fn claim(&mut self, what: &str, values: impl IntoIterator<Item = f64>, bound: f64) {
        self.record(what, values, Some(bound));
    }

    /// Records the worst of `values` (by magnitude), for which there is no bound.
    pub fn unbounded(&mut self, what: &str, values: impl IntoIterator<Item = f64>) {
        self.record(what, values, None);
    }

    fn record(&mut self, what: &str, values: impl IntoIterator<Item = f64>, bound: Option<f64>) {
        let worst = values.into_iter().map(f64::abs).fold(0.0, f64::max);
        self.claims.push(Claim { what: what.to_owned(), worst, bound });
    }

    pub fn print(&self) {
        heading(
            "Summary",
            "The worst result of each claim against its bound. Relative errors are shares of 1. Columns of the tables above that are not \
             named here have no bound.",
        );
        header("claim | worst | bound | ");
        for c in &self.claims {
            let verdict = c.bound.map_or("", |bound| if c.worst <= bound { "reached" } else { "**missed**" });
            let bound = c.bound.map_or("none".to_owned(), short);
            row!("{} | {} | {bound} | {verdict}", c.what, short(c.worst));
        }
    }
}

pub fn heading(title: &str, text: &str) {
    println!("\n## {title}\n\n{text}\n");
}

/// Begins a table; `names` are separated as in its rows.
pub fn header(names: &str) {
    println!("| {names} |\n|{}", "---|".repeat(names.split(" | ").count()));
}

/// Formats a value with three significant digits.
pub fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if size < 1e-3 {
        format!("{value:.1e}")
    } else {
        format!("{value:.*}", (2 - size.log10().floor() as i32).max(0) as usize)
    }
}

pub fn percent(share: f64) -> String {
    format!("{:+.2} %", 100.0 * share)
}

pub fn yes(value: bool) -> &'static str {
    if value { "yes" } else { "no" }
}
