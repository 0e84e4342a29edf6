//! Sessions that are training subjects: the subject ends when its goal is reached or a limit is passed.

use std::sync::Arc;

use endowire_assess::{Exam, Score, Standing};

use endowire_core::{Error, Result};

use super::Session;
use crate::input::Input;
use crate::readout::EventKind;

impl Session {
    /// Makes the session a training subject. Instruments stop when it ends, and later motions do not count.
    #[must_use]
    pub fn with_exam(mut self, exam: Exam) -> Self {
        self.exam = Some(exam);
        self
    }

    /// Refuses in an exam what no patient allows: to undo, to go back, and to have it shown.
    pub(super) fn check_in_exam(&self, input: &Input) -> Result<()> {
        let what = match input {
            Input::Undo {} => "undo",
            Input::Redo {} => "redo",
            Input::GoTo { .. } => "go_to",
            Input::Script {} => "script",
            _ => return Ok(()),
        };
        match &self.exam {
            Some(exam) if exam.subject().exam => {
                Err(Error::parameter("do", format!("{what:?}"), "this is an exam: go on with your hands"))
            }
            _ => Ok(()),
        }
    }

    /// Ends the subject if the last recorded tick ends it.
    pub(super) fn examine(&mut self) {
        let Some(exam) = &mut self.exam else { return };
        let Some(ended) = exam.follow(self.telemetry.record()).and_then(|score| score.verdict.ended) else {
            return;
        };
        self.stop();
        self.demonstration = None;
        let text = format!("the subject has ended: {}", ended.by.words());
        self.happened(EventKind::Ended, text);
    }

    /// Whether the task of a subject is still being read: nothing was done yet. A clock stands meanwhile.
    pub fn waits_for_hands(&self) -> bool {
        self.exam.is_some() && self.ticks == 0 && self.inputs.is_empty()
    }

    /// Progress of the subject, if there is one.
    pub fn standing(&self) -> Option<Standing> {
        self.exam.as_ref().map(|exam| exam.standing(self.telemetry.record()))
    }

    /// The score of the subject, if there is one; if it has not ended, that of the session so far. `None` if nothing was
    /// done yet.
    pub fn score(&self) -> Option<Arc<Score>> {
        let record = Some(self.telemetry.record()).filter(|record| !record.is_empty())?;
        self.exam.clone().map(|exam| exam.score(record))
    }
}
