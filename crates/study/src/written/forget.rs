//! Forgets a person.

use crate::codes::PersonCode;
use crate::error::StudyError;
use crate::folder::{Group, GroupState, StudyFolder};

impl StudyFolder {
    /// Removes everything about a person, and writes the tables again.
    ///
    /// The trials of the person's group are removed as a whole: the motion of each hand follows from the motion of the others, so no trial of the group could be
    /// kept and replayed without this person. Answers of the others of the group are kept. The row of the group is given again.
    ///
    /// # Errors
    ///
    /// [`StudyError::Nobody`] if no session has had a person with this code; otherwise [`StudyError::File`]. The same call then goes on.
    pub fn forget(&mut self, person: PersonCode) -> Result<(), StudyError> {
        let (code, seat) = person.group_and_seat(self.study().group_size());
        let Some(group) = self.groups().get(code.index()) else {
            return Err(StudyError::Nobody { path: self.path().to_path_buf(), person });
        };
        let answers = group.answers().iter().filter(|answer| answer.seat != seat).cloned().collect();
        // A second person of the same group may be forgotten later, and the earlier codes must stay in the file.
        let mut persons = match &group.state {
            GroupState::Forgotten { persons, .. } => persons.clone(),
            GroupState::Session(_) => Vec::new(),
        };
        persons.push(person);
        // The call may be a repetition after a crash: the person is then in the list already.
        persons.sort_unstable();
        persons.dedup();
        let group = Group { code, slot: group.slot, state: GroupState::Forgotten { persons, answers } };
        self.replace(group)?;
        self.write_tables()
    }
}
