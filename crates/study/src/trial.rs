//! The scene of a trial, for people or for modelled persons.

use std::time::Duration;

use cohaptic_linkfile::FileError;
use cohaptic_linkfile::document::key_text;
use cohaptic_scene::{Scene, scene_text};

use crate::model::{Person, Study};
use crate::sequence::TrialPlan;

/// Persons at the hands of a trial.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Players<'a> {
    /// People: the hands are pointers.
    People,
    /// Modelled persons, indexed by seat: the hands are simulated.
    Modelled(&'a [Person]),
}

/// The scene of a trial.
#[derive(Clone, PartialEq, Debug)]
pub struct TrialScene {
    /// Text of the scene file: the scene of the study with the values of the condition, the seed of the trial and the analysed measures. The run ends with its
    /// task.
    pub text: String,
    /// Scene of `text`, read.
    pub scene: Scene,
    /// Index in [`Scene::peers`] of the hand of each person, indexed by seat.
    pub hands: Vec<usize>,
}

impl Study {
    /// Returns the scene of a trial.
    ///
    /// # Errors
    ///
    /// [`FileError`] if the scene is refused with these values. [`Study::read`] has read each condition, so this happens only for modelled persons whose
    /// numbers are out of range.
    pub fn trial_scene(&self, plan: &TrialPlan, players: Players<'_>) -> Result<TrialScene, FileError> {
        let overrides = [format!("scene.seed={}", plan.seed)].into_iter().chain(self.players(plan.condition, players));
        self.scene_with(plan.condition, overrides)
    }

    /// Reads the scene of a condition, as people play it.
    pub(crate) fn condition_scene(&self, condition: usize) -> Result<TrialScene, FileError> {
        self.scene_with(condition, [])
    }

    /// Reads the scene of a condition with modelled persons at the hands, indexed by seat.
    pub(crate) fn scene_of_persons(&self, condition: usize, persons: &[Person]) -> Result<TrialScene, FileError> {
        self.scene_with(condition, self.players(condition, Players::Modelled(persons)))
    }

    fn scene_with(&self, condition: usize, more: impl IntoIterator<Item = String>) -> Result<TrialScene, FileError> {
        let measures: Vec<String> = self.measures.iter().map(|name| format!("\"{name}\"")).collect();
        let mut overrides = self.conditions[condition].overrides.clone();
        overrides.extend([format!("measure.names=[{}]", measures.join(", ")), "task.end=stop".to_owned()]);
        overrides.extend(more);
        let whole = scene_text(&self.scene_text, &self.scene_file, &overrides)?;
        // Expectations hold for the scene as written. Each key at the top level has one line.
        let text = whole.lines().filter(|line| !line.starts_with("expect = ")).fold(String::new(), |mut text, line| {
            text.push_str(line);
            text.push('\n');
            text
        });
        let scene = Scene::parse_live(&text, &self.scene_file, &[])?;
        let hands = self.hands.iter().filter_map(|name| scene.peer_index(name)).collect();
        Ok(TrialScene { text, scene, hands })
    }

    /// Returns the overrides that put persons at the hands.
    fn players(&self, condition: usize, players: Players<'_>) -> Vec<String> {
        let Players::Modelled(persons) = players else { return Vec::new() };
        let tracks = self.conditions[condition].tracks;
        let mut overrides = Vec::new();
        for (name, person) in self.hands.iter().zip(persons) {
            let peer = format!("peers.{}", key_text(name));
            let Person { movement, visual_delay, reaction, noise, crossover } = person;
            let nanos = |duration: &Duration| format!("\"{}ns\"", duration.as_nanos());
            let (movement, visual_delay, reaction) = (nanos(movement), nanos(visual_delay), nanos(reaction));
            // A scene refuses keys of the other law.
            let keys = if tracks {
                format!("visual-delay = {visual_delay}, crossover = {crossover:?}")
            } else {
                format!("move = {movement}, visual-delay = {visual_delay}, reaction = {reaction}, noise = {noise:?}")
            };
            overrides.push(format!("{peer}.kind=simulated"));
            overrides.push(format!("{peer}.hand={{ operator = {{ {keys} }} }}"));
        }
        overrides
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::Hand;
    use cohaptic_peer::operator::OperatorLaw;
    use cohaptic_scene::{PeerKind, TaskEnd};

    use super::*;
    use crate::codes::GroupCode;
    use crate::sequence::{Sequence, Step};
    use crate::testing::{study, track_study};

    #[test]
    fn a_trial_has_the_values_of_its_condition_its_seed_and_its_players() {
        let study = study();
        let session = Sequence::new(&study, GroupCode::of_index(1), 1);
        let Step::Trial(plan) = session.step() else { unreachable!() };
        let people = study.trial_scene(&plan, Players::People).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(people.scene.seed, plan.seed);
        assert_eq!((people.hands.as_slice(), people.scene.task.as_ref().map(|task| task.end)), (&[0, 1][..], Some(TaskEnd::Stop)));
        assert!(people.hands.iter().all(|hand| matches!(people.scene.peers[*hand].kind, PeerKind::Pointer(..))));
        assert!(people.scene.measure.is_some_and(|measure| measure.names.len() == 2));
        // The second row of the square begins with the second condition, the longer delay.
        assert_eq!((plan.condition, people.scene.links.between(0, 1).mean_delay()), (1, Duration::from_millis(100)));
        let slow = Person { movement: Duration::from_millis(400), ..study.operator };
        let modelled = study.trial_scene(&plan, Players::Modelled(&[slow, study.operator])).unwrap_or_else(|error| panic!("{error}"));
        assert!(modelled.scene.peers.iter().all(|peer| matches!(peer.kind, PeerKind::Simulated)));
        assert!(matches!(modelled.scene.peers[0].hand, Some(Hand::Operator { .. })));
        // The text alone is the scene.
        assert_eq!(Scene::parse(&modelled.text, &study.scene_file, &[]).unwrap(), modelled.scene);
    }

    #[test]
    fn persons_who_track_have_a_visual_delay_and_a_crossover_frequency() {
        let folder = tempfile::tempdir().unwrap();
        let study = track_study(folder.path());
        let session = Sequence::new(&study, GroupCode::of_index(0), 0);
        let Step::Trial(plan) = session.step() else { unreachable!() };
        let quick = Person { visual_delay: Duration::from_millis(150), crossover: 2.5, ..study.operator };
        let trial = study.trial_scene(&plan, Players::Modelled(&[quick, study.operator])).unwrap_or_else(|error| panic!("{error}"));
        for (peer, visual_delay, frequency) in [(0, 150, 2.5), (1, 200, 2.0)] {
            let operator = trial.scene.operator(peer).unwrap();
            assert_eq!((operator.visual_delay, &operator.law), (Duration::from_millis(visual_delay), &OperatorLaw::Crossover { frequency }));
        }
    }
}
