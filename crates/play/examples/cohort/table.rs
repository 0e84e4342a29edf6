//! The table of scores, in Markdown, and whether each subject puts trainees in the order in which a teacher would.

use std::fmt;

use endowire_assess::auc;

use super::kept::Row;
use super::trainee::{Class, KINDS};

/// Scores from which on, and up to which, kinds must be.
const GOOD: f64 = 90.0;
const BAD: f64 = 40.0;

/// A subject: its name and the score of each kind.
struct Column {
    name: String,
    scores: Vec<f64>,
}

/// Scores of all kinds in subjects.
#[derive(Default)]
pub(crate) struct Table {
    columns: Vec<Column>,
}

impl Table {
    /// Adds a subject with the scores of all kinds.
    pub(crate) fn add(&mut self, name: &str, rows: &[Row]) {
        let scores: Vec<f64> = rows.iter().map(|row| row.score).collect();
        assert_eq!(scores.len(), KINDS.len(), "{name}: a score for each kind");
        self.columns.push(Column { name: name.to_owned(), scores });
    }

    /// Area under the curve of those who pass against the others, in some subjects.
    fn auc<'a>(columns: impl Iterator<Item = &'a Column>) -> f64 {
        let mut sides = [vec![], vec![]];
        for column in columns {
            for (kind, score) in KINDS.iter().zip(&column.scores) {
                sides[usize::from(kind.class.passes())].push(*score);
            }
        }
        auc(&sides[0], &sides[1])
    }
}

impl Column {
    /// Least and largest score of a class.
    fn range(&self, class: Class) -> [f64; 2] {
        let of =
            KINDS.iter().zip(&self.scores).filter(|(kind, _)| kind.class == class).map(|(_, score)| *score);
        [of.clone().fold(f64::MAX, f64::min), of.fold(f64::MIN, f64::max)]
    }

    /// What is not as it must be.
    fn faults(&self) -> Vec<String> {
        let mut faults = vec![];
        for pair in Class::ALL.windows(2) {
            let ([least, _], [_, largest]) = (self.range(pair[0]), self.range(pair[1]));
            if least <= largest {
                faults.push(format!(
                    "{:?} {least:.1} and {:?} {largest:.1} are not in order",
                    pair[0], pair[1]
                ));
            }
        }
        let [least, _] = self.range(Class::Good);
        if least < GOOD {
            faults.push(format!("Good {least:.1} is below {GOOD}"));
        }
        for class in [Class::Reckless, Class::Blind] {
            let [_, largest] = self.range(class);
            if largest > BAD {
                faults.push(format!("{class:?} {largest:.1} is above {BAD}"));
            }
        }
        faults
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cells =
            |of: &dyn Fn(&Column) -> String| self.columns.iter().map(of).collect::<Vec<_>>().join(" | ");
        writeln!(f, "| class | kind | {} |", cells(&|column| column.name.replace('_', " ")))?;
        writeln!(f, "|---|---|{}", "---|".repeat(self.columns.len()))?;
        for (row, kind) in KINDS.iter().enumerate() {
            let class = format!("{:?}", kind.class).to_lowercase();
            let scores = cells(&|column| format!("{:.0}", column.scores[row]));
            writeln!(f, "| {class} | {} | {scores} |", kind.name)?;
        }
        let aucs = cells(&|column| format!("{:.3}", Self::auc(std::iter::once(column))));
        writeln!(f, "| | AUC | {aucs} |\n")?;
        writeln!(f, "all subjects: AUC {:.3}", Self::auc(self.columns.iter()))?;
        for column in &self.columns {
            for fault in column.faults() {
                writeln!(f, "{}: {fault}", column.name)?;
            }
        }
        Ok(())
    }
}
