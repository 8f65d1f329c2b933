use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::*;
use crate::model::QuestionKind;
use crate::testing::study;

fn session(study: &Study, slot: usize) -> Sequence {
    Sequence::new(study, GroupCode::of_index(slot), slot)
}

fn trial(session: &Sequence) -> TrialPlan {
    match session.step() {
        Step::Trial(plan) => plan,
        other @ (Step::Questions { .. } | Step::Break { .. } | Step::Done | Step::Abandoned) => panic!("{other:?}"),
    }
}

fn end(session: &mut Sequence, faults: &[Fault]) {
    session.handle(Event::TrialEnded { faults: faults.to_vec() }).unwrap_or_else(|error| panic!("{error}"));
}

/// Answers all due questions.
fn answer(study: &Study, session: &mut Sequence) {
    while let Step::Questions { due, .. } = session.step() {
        let (seat, question) = due.iter().enumerate().find_map(|(seat, due)| Some((seat, *due.first()?))).unwrap();
        let values = vec![5; study.questions[question].values()];
        session.handle(Event::Answered(Answer { seat, question, values })).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn an_invalid_trial_is_repeated_once_at_the_end_of_its_block() {
    let study = Study { practice: 1, trials: 3, questions: Vec::new(), breaks: None, ..study() };
    let mut session = session(&study, 0);
    let mut seen = Vec::new();
    while let Step::Trial(plan) = session.step() {
        // The end of the loop does not depend on the rule under test.
        if plan.position > 1 || seen.len() > 8 {
            break;
        }
        seen.push((plan.code.number, plan.trial, plan.practice, plan.repeats));
        // Practice and the second trial are not valid, and neither is the repetition of the second trial.
        let faults: &[Fault] = if plan.practice || plan.trial == 2 { &[Fault::HiddenPage] } else { &[] };
        end(&mut session, faults);
    }
    assert_eq!(seen, [(1, 1, true, None), (2, 1, false, None), (3, 2, false, None), (4, 3, false, None), (5, 2, false, Some(3))]);
    // Of four conditions with four planned trials, one trial was repeated.
    assert_eq!(trial(&session).of, 17);
}

#[test]
fn the_experimenter_repeats_the_last_valid_trial_of_the_block_and_no_other() {
    let scale = Question {
        name: "felt".to_owned(),
        after: After::Condition,
        kind: QuestionKind::Scale { text: String::new(), ends: Default::default(), steps: 7 },
    };
    let study = Study { practice: 1, trials: 2, questions: vec![scale], breaks: None, ..study() };
    let mut session = session(&study, 0);
    assert_eq!(session.handle(Event::Repeat), Err(SequenceError::NothingToRepeat));
    end(&mut session, &[]);
    // Practice is not repeated.
    assert_eq!(session.handle(Event::Repeat), Err(SequenceError::NothingToRepeat));
    end(&mut session, &[]);
    end(&mut session, &[]);
    // The block is over, and nobody has answered yet: the repetition comes before the questions.
    assert!(matches!(session.step(), Step::Questions { after: After::Condition, .. }));
    assert_eq!(session.handle(Event::Repeat), Ok(()));
    assert_eq!((trial(&session).repeats, session.ended()[2].faults.as_slice()), (Some(3), &[Fault::Repeated][..]));
    end(&mut session, &[]);
    assert_eq!(session.handle(Event::Repeat), Err(SequenceError::NothingToRepeat));
    answer(&study, &mut session);
    // The last trial belongs to the block before.
    assert_eq!((trial(&session).position, session.handle(Event::Repeat)), (2, Err(SequenceError::NothingToRepeat)));
    // An answer about the condition is about all of its trials, so that no trial follows the first answer.
    while matches!(session.step(), Step::Trial(_)) {
        end(&mut session, &[]);
    }
    session.handle(Event::Answered(Answer { seat: 0, question: 0, values: vec![5] })).unwrap();
    assert_eq!(session.handle(Event::Repeat), Err(SequenceError::NothingToRepeat));
}

#[test]
fn questions_about_a_trial_follow_the_trials_that_count_alone() {
    let scale = Question {
        name: "felt".to_owned(),
        after: After::Trial,
        kind: QuestionKind::Scale { text: String::new(), ends: Default::default(), steps: 7 },
    };
    let study = Study { practice: 1, trials: 2, questions: vec![scale], breaks: None, ..study() };
    let mut session = session(&study, 0);
    let is_asked = |session: &Sequence| matches!(session.step(), Step::Questions { after: After::Trial, .. });
    let mut asked = Vec::new();
    // The first trial is for practice, and the second is not valid. The third is valid at first, and the experimenter repeats the trial after the first answer.
    for faults in [&[][..], &[Fault::SilentPointer], &[]] {
        end(&mut session, faults);
        asked.push(is_asked(&session));
    }
    assert_eq!(asked, [false, false, true]);
    session.handle(Event::Answered(Answer { seat: 0, question: 0, values: vec![5] })).unwrap();
    assert_eq!(session.handle(Event::Repeat), Ok(()));
    assert_eq!((trial(&session).trial, trial(&session).repeats), (1, Some(2)));
    // Of the repetitions one counts, and the other does not and is not repeated again.
    end(&mut session, &[]);
    assert!(is_asked(&session));
    answer(&study, &mut session);
    assert_eq!(trial(&session).repeats, Some(3));
    end(&mut session, &[Fault::HiddenPage]);
    assert_eq!(trial(&session).position, 2);
    let numbers: Vec<Option<usize>> = session.answers().iter().map(|answer| answer.number).collect();
    assert_eq!(numbers, [Some(3), Some(4), Some(4)]);
}

#[test]
fn breaks_come_after_every_few_trials_and_not_at_the_end() {
    let study =
        Study { practice: 0, trials: 3, questions: Vec::new(), breaks: Some(Breaks { every: 4, at_least: Duration::from_secs(30) }), ..study() };
    let mut session = session(&study, 1);
    let mut breaks = Vec::new();
    loop {
        match session.step() {
            Step::Trial(_) => end(&mut session, &[]),
            Step::Break { at_least } => {
                assert_eq!(at_least, Duration::from_secs(30));
                breaks.push(session.ended().len());
                session.handle(Event::BreakOver).unwrap();
            }
            Step::Done => break,
            other @ (Step::Questions { .. } | Step::Abandoned) => panic!("{other:?}"),
        }
    }
    assert_eq!((breaks.as_slice(), session.ended().len()), (&[4, 8][..], 12));
    assert_eq!(session.handle(Event::Abandon), Err(SequenceError::Ended));
}

#[test]
fn answers_are_checked_and_all_people_answer_before_the_session_goes_on() {
    let study = study();
    let mut session = session(&study, 0);
    while matches!(session.step(), Step::Trial(_) | Step::Break { .. }) {
        let event = if matches!(session.step(), Step::Break { .. }) { Event::BreakOver } else { Event::TrialEnded { faults: Vec::new() } };
        session.handle(event).unwrap();
    }
    let given = |seat, question, values: &[u32]| Event::Answered(Answer { seat, question, values: values.to_vec() });
    assert_eq!(session.handle(given(0, 0, &[0, 5, 100, 50, 20, 52])), Err(SequenceError::NoAnswer { question: "workload".to_owned() }));
    assert_eq!(session.handle(given(0, 0, &[0, 5, 100])), Err(SequenceError::NoAnswer { question: "workload".to_owned() }));
    assert_eq!(session.handle(given(2, 0, &[0; 6])), Err(SequenceError::NotAsked));
    assert_eq!(session.handle(given(0, 1, &[1])), Err(SequenceError::NotAsked));
    assert_eq!(session.handle(given(0, 0, &[0, 5, 100, 50, 20, 55])), Ok(()));
    assert_eq!(session.handle(given(0, 0, &[0; 6])), Err(SequenceError::Answered));
    assert_eq!(session.step(), Step::Questions { after: After::Condition, due: vec![vec![], vec![0]] });
    assert_eq!(session.handle(Event::TrialEnded { faults: Vec::new() }), Err(SequenceError::Other { waits_for: "answers to questions" }));
    assert_eq!(session.handle(given(1, 0, &[0; 6])), Ok(()));
    assert_eq!((trial(&session).position, session.answers().len()), (2, 2));
}

fn faults() -> impl Strategy<Value = Vec<Fault>> {
    prop_oneof![4 => Just(Vec::new()), 1 => Just(vec![Fault::LateTicks]), 1 => Just(vec![Fault::LostPartner, Fault::HiddenPage])]
}

fn event() -> impl Strategy<Value = Event> {
    let answer = (0_usize..3, 0_usize..3, prop::collection::vec(0_u32..110, 0..7));
    prop_oneof![
        8 => faults().prop_map(|faults| Event::TrialEnded { faults }),
        4 => answer.prop_map(|(seat, question, values)| Event::Answered(Answer { seat, question, values })),
        2 => Just(Event::BreakOver),
        2 => Just(Event::Repeat),
    ]
}

properties! {
    /// Sessions of random events: refused events change nothing, the kept events make the state again, and a completed session has run each analysed trial of
    /// each condition, and a repetition of each trial that was not valid.
    #[test]
    fn every_session_keeps_its_rules(events in prop::collection::vec(event(), 0..80), slot in 0_usize..6, abandons in any::<bool>()) {
        let study = study();
        let mut session = session(&study, slot);
        for event in events {
            let before = session.clone();
            if session.handle(event).is_err() {
                prop_assert_eq!(&session, &before);
            }
        }
        if abandons && session.handle(Event::Abandon).is_ok() {
            prop_assert_eq!(session.step(), Step::Abandoned);
        }
        for _ in 0..1000 {
            match session.step() {
                Step::Trial(plan) => {
                    prop_assert_eq!(plan.code.number, session.ended().len() + 1);
                    end(&mut session, &[]);
                }
                Step::Questions { .. } => answer(&study, &mut session),
                Step::Break { .. } => session.handle(Event::BreakOver).unwrap(),
                Step::Done | Step::Abandoned => break,
            }
        }
        let restored = Sequence::restored(&study, session.group(), slot, session.events().to_vec());
        prop_assert_eq!(restored.as_ref(), Ok(&session));
        if session.step() == Step::Done {
            let order: Vec<usize> = study.order_of(slot);
            for (position, condition) in (1..).zip(order) {
                let of = |wanted: &dyn Fn(&TrialPlan) -> bool| {
                    session.ended().iter().filter(|ended| ended.plan.position == position && wanted(&ended.plan)).collect::<Vec<_>>()
                };
                prop_assert!(of(&|_| true).iter().all(|ended| ended.plan.condition == condition));
                prop_assert_eq!(of(&|plan| plan.practice).len(), study.practice);
                let first = of(&|plan| !plan.practice && plan.repeats.is_none());
                prop_assert_eq!(first.len(), study.trials);
                let repeated: Vec<usize> = first.iter().filter(|ended| !ended.faults.is_empty()).map(|ended| ended.plan.code.number).collect();
                let mut again: Vec<usize> = of(&|plan| plan.repeats.is_some()).iter().filter_map(|ended| ended.plan.repeats).collect();
                again.sort_unstable();
                prop_assert_eq!(again, repeated);
            }
            // All people have answered every question about each condition.
            prop_assert_eq!(session.answers().len(), study.conditions.len() * 2);
        }
        let mut seeds: Vec<u64> = session.ended().iter().map(|ended| ended.plan.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        prop_assert_eq!(seeds.len(), session.ended().len());
    }
}
