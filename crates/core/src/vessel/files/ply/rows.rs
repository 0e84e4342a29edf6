//! Values of rows, read one after the other, as text or bytes.

use super::super::Reason;
use super::super::scalar::{Order, Scalar};
use crate::text::{lines, number, shown};

/// Rows from which values are taken.
pub(super) trait Rows {
    /// Starts the next row.
    fn begin(&mut self) -> Result<(), Reason>;
    /// The next value.
    fn value(&mut self, kind: Scalar) -> Result<f64, Reason>;
    /// Skips this many values of a type.
    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), Reason>;
    /// Upper bound of the number of remaining values.
    fn left(&self) -> usize;
}

/// Rows as text.
pub(super) struct TextRows<'a> {
    lines: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: (usize, &'a str),
    words: std::str::SplitWhitespace<'a>,
    /// Whether rows may continue on the next line: a few programs break long rows, or write everything on one line.
    flowing: bool,
    length: usize,
}

impl<'a> TextRows<'a> {
    /// Rows in `text`, one per line, or `flowing`; `before`: number of lines before it in the file.
    pub(super) fn new(text: &'a str, before: usize, flowing: bool) -> Self {
        let lines = lines(text).map(move |(number, line)| (number + before, line));
        Self {
            lines: Box::new(lines),
            line: (before, ""),
            words: "".split_whitespace(),
            flowing,
            length: text.len(),
        }
    }

    /// Whether only blanks remain.
    pub(super) fn is_at_end(&mut self) -> bool {
        self.words.next().is_none() && self.lines.all(|(_, line)| line.trim().is_empty())
    }

    fn next_line(&mut self) -> Result<(), Reason> {
        self.line =
            self.lines.next().ok_or_else(|| format!("line {}: the file ends here", self.line.0 + 1))?;
        self.words = self.line.1.split_whitespace();
        Ok(())
    }

    fn word(&mut self) -> Result<&'a str, Reason> {
        loop {
            match self.words.next() {
                Some(word) => return Ok(word),
                None if self.flowing => self.next_line()?,
                None => return Err(self.here("has fewer values than its element has properties")),
            }
        }
    }

    fn here(&self, why: &str) -> Reason {
        format!("line {}, {:?}: {why}", self.line.0, shown(self.line.1.trim()))
    }
}

impl Rows for TextRows<'_> {
    fn begin(&mut self) -> Result<(), Reason> {
        if self.flowing {
            return Ok(());
        }
        self.next_line()?;
        while self.line.1.trim().is_empty() {
            self.next_line()?;
        }
        Ok(())
    }

    fn value(&mut self, _: Scalar) -> Result<f64, Reason> {
        let word = self.word()?;
        number(word).ok_or_else(|| self.here(&format!("{:?} is no number", shown(word))))
    }

    fn skip(&mut self, _: Scalar, count: usize) -> Result<(), Reason> {
        (0..count).try_for_each(|_| self.word().map(drop))
    }

    fn left(&self) -> usize {
        self.length
    }
}

/// Rows as bytes.
pub(super) struct BinaryRows<'a> {
    pub(super) rest: &'a [u8],
    pub(super) order: Order,
}

/// The error for a binary file that ends too early.
const SHORT: &str = "the file ends here: it is cut off";

impl Rows for BinaryRows<'_> {
    fn begin(&mut self) -> Result<(), Reason> {
        Ok(())
    }

    fn value(&mut self, kind: Scalar) -> Result<f64, Reason> {
        let value = kind.read(self.rest, self.order).ok_or(SHORT)?;
        self.rest = &self.rest[kind.size()..];
        Ok(value)
    }

    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), Reason> {
        let length =
            kind.size().checked_mul(count).filter(|length| *length <= self.rest.len()).ok_or(SHORT)?;
        self.rest = &self.rest[length..];
        Ok(())
    }

    fn left(&self) -> usize {
        self.rest.len()
    }
}
