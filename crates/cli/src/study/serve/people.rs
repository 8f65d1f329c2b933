//! People of a group on the way from page to page: codes, consent, instructions, readiness, and the page of each person. Without clock, files and network.

use cohaptic_study::{After, Question, QuestionKind, Sequence, Step, Study, TLX, TrialPlan};
use serde_json::{Value, json};

use super::text::blocks;

/// Step of a person on the way to the first trial.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Way {
    /// The person sees the own code.
    Code,
    Consent,
    /// The person refused. Nothing is kept, and another person may come.
    Refused,
    Instructions,
    /// The person takes part.
    In,
}

/// Work of the program between two events of the session.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Work {
    #[default]
    None,
    /// The trial is about to begin, because everybody is ready.
    Starting,
    Running,
    /// The trial has ended, and its record is being kept.
    Keeping,
}

/// A person at a seat of the group.
#[derive(Clone, Debug)]
struct Person {
    way: Way,
    /// `true` if the person has pressed the button of the present page: before a trial, or at the end of a break.
    is_ready: bool,
    /// Page told last, with its number, counted from 1.
    told: (u64, Value),
}

/// People of a group, and the present page of each person.
#[derive(Debug)]
pub(super) struct People {
    people: Vec<Person>,
    /// `true` once everybody takes part. A person who is replaced after that would change the group.
    has_begun: bool,
    pub(super) work: Work,
    /// `true` if the present break may end.
    pub(super) may_end_break: bool,
    /// Line for the people about the trial before, such as the reason for its repetition.
    pub(super) note: String,
    /// Facts of the running trial for the page that draws the trial; each person's hand is added.
    pub(super) facts: Value,
    /// Peers of the people, indexed by seat.
    pub(super) hands: Vec<usize>,
}

impl People {
    /// Returns the people of a session. In a session with events, all people have agreed and read the instructions before.
    pub(super) fn of(session: &Sequence) -> Self {
        let has_begun = !session.events().is_empty();
        let way = if has_begun { Way::In } else { Way::Code };
        let person = Person { way, is_ready: false, told: (0, Value::Null) };
        let people = vec![person; session.people().len()];
        Self { people, has_begun, work: Work::None, may_end_break: false, note: String::new(), facts: Value::Null, hands: Vec::new() }
    }

    pub(super) fn way(&self, seat: usize) -> Way {
        self.people[seat].way
    }

    pub(super) fn has_begun(&self) -> bool {
        self.has_begun
    }

    pub(super) fn is_ready(&self, seat: usize) -> bool {
        self.people[seat].is_ready
    }

    pub(super) fn all_ready(&self) -> bool {
        self.people.iter().all(|person| person.is_ready)
    }

    pub(super) fn set_ready(&mut self, seat: usize, is_ready: bool) {
        self.people[seat].is_ready = is_ready;
    }

    /// The session has gone on: everybody has to press a button again.
    pub(super) fn next_step(&mut self) {
        self.people.iter_mut().for_each(|person| person.is_ready = false);
        self.may_end_break = false;
    }

    /// Moves a person on the way to the first trial.
    ///
    /// # Errors
    ///
    /// The reason why the person cannot do this on the present page.
    pub(super) fn walk(&mut self, seat: usize, word: &str) -> Result<(), String> {
        let way = match (self.people[seat].way, word) {
            (Way::Code, "begin") => Way::Consent,
            (Way::Consent, "consent") => Way::Instructions,
            (Way::Consent, "refuse") => Way::Refused,
            (Way::Instructions, "go on") => Way::In,
            _ => return Err("the page has changed meanwhile".to_owned()),
        };
        self.people[seat].way = way;
        self.has_begun |= self.people.iter().all(|person| person.way == Way::In);
        Ok(())
    }

    /// Makes the seat of a person who refused free for another person.
    pub(super) fn replace(&mut self, seat: usize) {
        self.people[seat] = Person { way: Way::Code, is_ready: false, told: (0, Value::Null) };
    }

    /// Returns the name of the page that a person sees.
    pub(super) fn page_name(&self, seat: usize) -> &str {
        self.people[seat].told.1["page"].as_str().unwrap_or_default()
    }

    /// Returns the page of a person, if its number is above `shown`.
    pub(super) fn news(&self, seat: usize, shown: u64) -> Option<(u64, &Value)> {
        let (number, page) = &self.people.get(seat)?.told;
        (*number > shown).then_some((*number, page))
    }

    /// Makes the pages again, and numbers those that have changed.
    pub(super) fn update(&mut self, study: &Study, session: &Sequence) {
        for seat in 0..self.people.len() {
            let mut page = self.page(study, session, seat);
            page["title"] = study.title.as_str().into();
            page["code"] = session.people()[seat].to_string().into();
            let (number, told) = &mut self.people[seat].told;
            if *told != page {
                (*number, *told) = (*number + 1, page);
            }
        }
    }

    fn page(&self, study: &Study, session: &Sequence, seat: usize) -> Value {
        let wait = |words: &str| json!({ "page": "wait", "words": words });
        let person = &self.people[seat];
        match person.way {
            Way::Code => return json!({ "page": "code" }),
            Way::Consent => return json!({ "page": "consent", "text": blocks(&study.consent) }),
            Way::Refused => return json!({ "page": "refused" }),
            Way::Instructions => return json!({ "page": "instructions", "text": blocks(&study.instructions) }),
            Way::In if !self.has_begun => return wait("Wait until everybody has read the instructions."),
            Way::In => {}
        }
        match session.step() {
            Step::Trial(plan) if self.work == Work::Running => {
                let mut facts = self.facts.clone();
                facts["hand"] = self.hands.get(seat).copied().into();
                json!({ "page": "trial", "trial": trial(&plan), "facts": facts })
            }
            Step::Trial(_) if self.work == Work::Keeping => wait("The trial is over."),
            Step::Trial(_) if person.is_ready => wait("The trial begins when everybody is ready."),
            Step::Trial(plan) => json!({ "page": "ready", "trial": trial(&plan), "note": self.note }),
            Step::Questions { due, .. } if due[seat].is_empty() => wait("Wait until everybody has answered."),
            Step::Questions { after, due } => {
                let asked: Vec<Value> = due[seat].iter().map(|index| question(*index, &study.questions[*index])).collect();
                json!({ "page": "questions", "about": about(after), "questions": asked, "note": self.note })
            }
            Step::Break { .. } if person.is_ready => wait("Wait until everybody has rested."),
            Step::Break { .. } => json!({ "page": "break", "may_end": self.may_end_break }),
            Step::Done => json!({ "page": "thanks" }),
            Step::Abandoned => json!({ "page": "abandoned" }),
        }
    }
}

fn trial(plan: &TrialPlan) -> Value {
    json!({ "number": plan.code.number, "of": plan.of, "practice": plan.practice })
}

/// Returns the subject of questions, in words.
const fn about(after: After) -> &'static str {
    match after {
        After::Trial => "about the last trial",
        After::Condition => "about all trials since these questions were asked last, or since the beginning",
        After::Study => "about the whole study",
    }
}

/// Returns a question for the page: scales from 0 to 100, or one choice of steps.
fn question(index: usize, question: &Question) -> Value {
    match &question.kind {
        QuestionKind::Tlx => {
            let scales: Vec<Value> = TLX.iter().map(|(_, text, ends)| json!({ "text": text, "ends": ends })).collect();
            json!({ "question": index, "scales": scales })
        }
        QuestionKind::Scale { text, ends, steps } => json!({ "question": index, "text": text, "ends": ends, "steps": steps }),
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_study::{Event, GroupCode};

    use super::*;

    fn study() -> Study {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../studies/pull/study.toml");
        Study::read(path.as_ref()).unwrap_or_else(|error| panic!("{error}"))
    }

    fn pages(people: &mut People, study: &Study, session: &Sequence) -> Vec<String> {
        people.update(study, session);
        (0..2).map(|seat| people.page_name(seat).to_owned()).collect()
    }

    #[test]
    fn two_people_come_to_the_first_trial_and_one_who_refuses_makes_room() {
        let study = study();
        let session = Sequence::new(&study, GroupCode::of_index(0), 0);
        let mut people = People::of(&session);
        assert_eq!(pages(&mut people, &study, &session), ["code", "code"]);
        assert!(people.walk(0, "consent").is_err() && people.walk(0, "go on").is_err());
        people.walk(0, "begin").unwrap();
        people.walk(1, "begin").unwrap();
        people.walk(0, "refuse").unwrap();
        assert_eq!(pages(&mut people, &study, &session), ["refused", "consent"]);
        assert!(people.walk(0, "consent").is_err());
        people.replace(0);
        for word in ["begin", "consent", "go on"] {
            people.walk(0, word).unwrap();
        }
        people.walk(1, "consent").unwrap();
        assert_eq!(pages(&mut people, &study, &session), ["wait", "instructions"]);
        people.walk(1, "go on").unwrap();
        assert_eq!(pages(&mut people, &study, &session), ["ready", "ready"]);
        // A page that has not changed has no news.
        let (number, page) = people.news(0, 0).map(|(number, page)| (number, page.clone())).unwrap();
        assert_eq!((&page["code"], &page["trial"]), (&json!("P01"), &json!({ "number": 1, "of": 28, "practice": true })));
        assert!(people.news(0, number).is_none());
        people.set_ready(1, true);
        assert_eq!(pages(&mut people, &study, &session), ["ready", "wait"]);
        assert!(people.news(0, number).is_none() && people.news(1, number).is_some());
    }

    #[test]
    fn a_group_that_has_trials_goes_on_without_consent_and_answers_each_its_own_questions() {
        let study = study();
        let mut session = Sequence::new(&study, GroupCode::of_index(0), 0);
        while matches!(session.step(), Step::Trial(_)) {
            session.handle(Event::TrialEnded { faults: Vec::new() }).unwrap();
        }
        let mut people = People::of(&session);
        assert_eq!(pages(&mut people, &study, &session), ["questions", "questions"]);
        let (_, page) = people.news(1, 0).unwrap();
        assert_eq!(page["questions"][0]["scales"].as_array().unwrap().len(), 6);
        assert_eq!(page["questions"][1]["steps"], 7);
    }
}
