//! A session that is a subject for trainees: it ends when its goal is reached or a limit is passed.

use std::sync::Arc;

use endowire_assess::{Exam, Score, Standing};

use super::Session;
use crate::readout::EventKind;

impl Session {
    /// The same as a subject for trainees: hands rest when it ends, and what is done later does not count.
    #[must_use]
    pub fn with_exam(mut self, exam: Exam) -> Self {
        self.exam = Some(exam);
        self
    }

    /// Ends the subject when what was noted last ends it.
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

    /// How the subject stands, if there is one.
    pub fn standing(&self) -> Option<Standing> {
        self.exam.as_ref().map(|exam| exam.standing(self.telemetry.record()))
    }

    /// The score of the subject, if there is one: of all so far where it has not ended.
    pub fn score(&self) -> Option<Arc<Score>> {
        self.exam.clone().map(|exam| exam.score(self.telemetry.record()))
    }
}
