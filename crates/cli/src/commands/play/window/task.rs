//! Display of a subject: the task at first and the score at the end over the 3D view, and the progress below.

use endowire_assess::{Score, Standing, Subject, Threshold};

use super::screen::{CHOSEN, TEXT, WARN};
use super::text::{Canvas, Writer};
use crate::subjects::verdict;

/// Font size, width of a letter and line spacing, pixels at the usual size.
const LETTER_PX: usize = 15;
const COLUMN_PX: usize = 9;
const LINE_PX: usize = 22;
const MARGIN_PX: usize = 12;
const BACK: u32 = 0x08_0c10;
/// Fraction of a limit from which on it is shown as a warning.
const NEARLY: f64 = 0.8;

/// A line and its colour.
type Line = (u32, String);

/// Places of the texts, each a corner and a size: task and score over the 3D view, progress in the panel below.
pub(super) struct Places {
    pub(super) over: ([usize; 2], [usize; 2]),
    pub(super) below: ([usize; 2], [usize; 2]),
}

/// Shows the texts of a subject, as far as there is room; `begun` is set once an instrument has moved.
pub(super) fn show(
    writer: &mut Writer,
    canvas: &mut Canvas,
    standing: &Standing,
    begun: bool,
    places: &Places,
) {
    write(writer, canvas, &standing_lines(standing), places.below);
    match &standing.score {
        Some(score) => write(writer, canvas, &score_lines(score), places.over),
        None if !begun => write(writer, canvas, &task_lines(&standing.task), places.over),
        None => {}
    }
}

/// Writes lines into a box that is at most as high as they are.
fn write(
    writer: &mut Writer,
    canvas: &mut Canvas,
    lines: &[Line],
    ([left, top], [width, height]): ([usize; 2], [usize; 2]),
) {
    let [margin, column, spacing] = [MARGIN_PX, COLUMN_PX, LINE_PX].map(|px| canvas.scale.px(px));
    let columns = width.saturating_sub(2 * margin) / column;
    let room = height.saturating_sub(margin) / spacing;
    if columns == 0 {
        return;
    }
    let lines = lines
        .iter()
        .flat_map(|(colour, text)| wrapped(text, columns).into_iter().map(move |line| (*colour, line)));
    let lines: Vec<Line> = lines.take(room).collect();
    canvas.fill([left, top], [width, spacing * lines.len() + margin], BACK);
    for (number, (colour, line)) in lines.iter().enumerate() {
        let at = [left + margin, top + spacing * (number + 1)];
        writer.write(canvas, at, LETTER_PX, *colour, line);
    }
}

fn task_lines(task: &Subject) -> Vec<Line> {
    let row = |threshold: &Threshold| (TEXT, format!("  {}: {}", threshold.title(), threshold.words()));
    let head = (CHOSEN, format!("{} (level {})", task.name, task.level));
    let text = (TEXT, task.text.clone());
    let exam = (WARN, "An exam: the 3D view is hidden, and nothing can be undone.".to_owned());
    let exam = task.exam.then_some(exam);
    [head, text].into_iter().chain(exam).chain(task.threshold.iter().map(row)).collect()
}

fn standing_lines(standing: &Standing) -> Vec<Line> {
    let to_go = standing.to_go.iter().map(|line| (CHOSEN, line.clone()));
    let mut lines: Vec<Line> = to_go.collect();
    lines.extend(standing.used.iter().map(|used| {
        let colour = if used.value > NEARLY * used.limit { WARN } else { TEXT };
        let digits = if used.unit == "N" { 3 } else { 1 };
        (colour, format!("{}: {:.digits$} of {} {}", used.what, used.value, used.limit, used.unit))
    }));
    lines
}

fn score_lines(score: &Score) -> Vec<Line> {
    let head = (if score.verdict.passed { CHOSEN } else { WARN }, verdict(score));
    let rows = score.asked().map(|(scored, threshold)| {
        let (kept, value) = (scored.kept_words(), scored.value_words());
        let colour = if scored.passed == Some(true) { TEXT } else { WARN };
        (colour, format!("  {kept:<10} {}: {value}, {}", scored.metric.title, threshold.words()))
    });
    let end = (TEXT, "What is done now does not count. Esc ends.".to_owned());
    std::iter::once(head).chain(rows).chain([end]).collect()
}

/// Breaks a text into lines of `columns` letters between words. A text that begins with a blank is a table row and is
/// truncated instead.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    if text.starts_with(' ') {
        return vec![text.chars().take(columns).collect()];
    }
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if lines[last].is_empty() {
            lines[last] = word.to_owned();
        } else if lines[last].chars().count() + 1 + word.chars().count() <= columns {
            lines[last] += &format!(" {word}");
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_kept_whole_and_rows_of_tables_as_they_are() {
        assert_eq!(wrapped("push the\nwire on", 9), ["push the", "wire on"]);
        assert_eq!(wrapped("unbreakable", 4), ["unbreakable"], "a word that is too long leaves the box");
        assert_eq!(wrapped("  a    b", 20), ["  a    b"]);
        assert_eq!(wrapped("", 4), [""]);
    }
}
