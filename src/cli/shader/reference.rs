//! `tusche shader reference`: every input, output and function, from the tables that the code itself uses.

use super::args::ReferenceArguments;
use crate::cli::{Failure, print};
use crate::shade::reference;

pub(super) fn run(arguments: &ReferenceArguments) -> Result<(), Failure> {
    let page = reference::markdown();
    print(&if arguments.markdown { page } else { plain(&page) })
}

/// Markdown as text for a terminal: the tables that it holds become columns.
fn plain(page: &str) -> String {
    let mut text = String::new();
    let mut table: Vec<Vec<String>> = Vec::new();
    for line in page.lines() {
        match cells(line) {
            Some(cells) => table.push(cells),
            None => {
                text.push_str(&columns(&std::mem::take(&mut table)));
                if !line.starts_with("```") {
                    let heading = ["# ", "## ", "### "].iter().find_map(|mark| line.strip_prefix(mark));
                    text.push_str(heading.unwrap_or(line));
                    text.push('\n');
                }
            }
        }
    }
    text.push_str(&columns(&table));
    text
}

/// The cells of a table's row.
fn cells(line: &str) -> Option<Vec<String>> {
    let inner = line.strip_prefix('|')?.strip_suffix('|')?;
    // A bar inside of a cell is written `\|`.
    let inner = inner.replace("\\|", "\u{0}");
    Some(inner.split('|').map(|cell| cell.trim().replace('\u{0}', "|").replace('`', "")).collect())
}

/// A table with aligned columns, the last as long as it is. The line below its head is left out.
fn columns(table: &[Vec<String>]) -> String {
    let rows: Vec<_> = table.iter().filter(|row| !row.iter().all(|cell| cell.chars().all(|c| c == '-'))).collect();
    let count = rows.iter().map(|row| row.len()).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| Some(row.get(column)?.chars().count())).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            line.push_str(&format!("{cell:<width$}  "));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_become_columns() {
        let page = "# Title\n\nA `word`.\n\n| name | what |\n|---|---|\n| `a` | x \\| y |\n| `longer` |  |\n\n```rust\n    code\n```\n";
        let text = "Title\n\nA `word`.\n\nname    what\na       x | y\nlonger\n\n    code\n";
        assert_eq!(plain(page), text);
    }
}
