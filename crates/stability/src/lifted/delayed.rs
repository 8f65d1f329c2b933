//! A frame with samples long under way, as a loop with delays instead of a large matrix.

use super::frame::FrameMap;
use crate::Matrix;
use crate::determinant::{DelayedLoop, DelayedLoopError, Kernel};

impl FrameMap {
    /// Returns the loop with the eigenvalues of [`FrameMap::monodromy`], except some zero eigenvalues, as its characteristic roots. Fails if a delay has too
    /// many steps or an entry is not finite.
    ///
    /// The signals of the loop are the relative states x; for each sample sent in a frame, the value V of the sample at the beginning of the next frame,
    /// relative to the reference at that instant; and the distance d of the reference's motion in the previous frame. A sample sent L frames ago is
    ///
    /// ```text
    /// y(f) = V(f − L + 1) − t·(d(f) + d(f−1) + … + d(f − L + 2))
    /// ```
    ///
    /// where t is the displacement of a sample under a displacement of everything by 1. The first term is a delay; the sum comes from the motion of the
    /// reference in relative coordinates.
    pub(crate) fn delayed_loop(&self) -> Result<DelayedLoop, DelayedLoopError> {
        let states = self.state_unknowns();
        let kept: Vec<usize> = (0..self.states.rows()).filter(|row| Some(*row) != self.reference()).collect();
        let sent = self.sent.rows();
        let size = states + sent + usize::from(self.reference().is_some());
        let moved = size - 1;
        // One row of the frame for each signal, and the factor of the subtracted motion of the reference.
        let mut rows: Vec<(&[f64], f64)> = kept.iter().map(|row| (self.states.row(*row), self.displacement(*row))).collect();
        rows.extend((0..sent).map(|row| (self.sent.row(row), self.translation(sent - row))));
        let reference = self.reference().map(|row| self.states.row(row));
        if let Some(reference) = reference {
            rows.push((reference, 0.0));
        }
        let coefficient = |row: usize, column: usize| {
            let (entries, displaced) = rows[row];
            entries[column] - reference.map_or(0.0, |reference| displaced * reference[column])
        };
        // States of the previous frame act without delay. Samples act through delays, which the loop below adds term by term.
        let mut now = Matrix::from_fn(size, size, |row, column| if column < states { coefficient(row, column) } else { 0.0 });
        let mut terms: Vec<(Kernel, Matrix)> = Vec::new();
        for (number, (node, age)) in self.used.iter().enumerate() {
            let of_node = self.sent_by(*node);
            // A sample of age `age` was sent `frames` frames ago, because every frame sends `of_node.len()` numbers of the node; `column` is the signal of
            // the sample with the same place in its frame.
            let frames = age.div_ceil(of_node.len().max(1));
            let column = states + of_node.start + of_node.len() * frames - age;
            let mut add = |kernel: Kernel, column: usize, factor: f64| {
                let matrix = if kernel.steps() == 0 {
                    &mut now
                } else {
                    let place = terms.iter().position(|(known, _)| *known == kernel).unwrap_or_else(|| {
                        terms.push((kernel, Matrix::zeros(size, size)));
                        terms.len() - 1
                    });
                    &mut terms[place].1
                };
                for row in 0..size {
                    matrix[(row, column)] += factor * coefficient(row, states + number);
                }
            };
            if u32::try_from(frames).is_err() {
                return Err(DelayedLoopError::TooLong { steps: frames });
            }
            let steps = |frames: usize| u32::try_from(frames).unwrap_or(u32::MAX);
            add(Kernel::Delay(steps(frames - 1)), column, 1.0);
            // A sample of the previous frame is already relative to the present reference. Older samples get the sum of the motions of the reference since.
            if reference.is_some() && frames >= 2 {
                let translation = self.translation(*age);
                add(Kernel::Delay(0), moved, -translation);
                if frames >= 3 {
                    add(Kernel::Sum(steps(frames - 2)), moved, -translation);
                }
            }
        }
        DelayedLoop::new(now, terms)
    }

    /// Returns the number of rows of the monodromy matrix.
    pub(crate) fn size(&self) -> usize {
        self.state_unknowns() + self.history()
    }

    /// Returns the number of signals of [`FrameMap::delayed_loop`].
    pub(crate) fn signals(&self) -> usize {
        self.state_unknowns() + self.sent.rows() + usize::from(self.reference().is_some())
    }
}
