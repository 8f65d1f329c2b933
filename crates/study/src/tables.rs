//! The tables of trials and of answers: columns and rows.

use std::sync::Arc;

use cohaptic_campaign::{Column, Format, Kind, Row, Value, write_table};

use crate::error::StudyError;
use crate::folder::{Group, StudyFolder, TrialRecord};
use crate::model::{After, QuestionKind, Study, TLX};
use crate::sequence::{EndedTrial, GivenAnswer};

/// A table with its columns.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Table {
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Row>,
}

/// A kept trial with its record.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct KeptTrial {
    /// Index of the group.
    pub(crate) group: usize,
    /// Plan of the trial, and its faults by now.
    pub(crate) ended: EndedTrial,
    pub(crate) record: TrialRecord,
}

impl StudyFolder {
    /// Returns the bytes of a table's file.
    pub(crate) fn table_bytes(&self, format: Format, table: &Table) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let about = ("cohaptic.study", self.study().text.as_str());
        write_table(format, &mut bytes, &table.columns, &table.rows, (about, self.program()))?;
        Ok(bytes)
    }

    /// Reads the records of all trials, in the order of their codes, with movements for the records of earlier versions.
    pub(crate) fn kept_trials(&self) -> Result<Vec<KeptTrial>, StudyError> {
        let with_movements = |trial: KeptTrial| {
            let record = trial.record.with_movements(&self.trial(trial.ended.plan.code))?;
            Ok(KeptTrial { record, ..trial })
        };
        self.recorded_trials()?.into_iter().map(with_movements).collect()
    }

    /// Reads the records of all trials as they are on the disk, in the order of their codes.
    pub(crate) fn recorded_trials(&self) -> Result<Vec<KeptTrial>, StudyError> {
        let mut trials = Vec::new();
        for (place, group) in self.groups().iter().enumerate() {
            for ended in group.ended() {
                let record = TrialRecord::read(&self.trial(ended.plan.code))?;
                trials.push(KeptTrial { group: place, ended: ended.clone(), record });
            }
        }
        Ok(trials)
    }

    /// Returns the table of trials, a row per trial and person.
    pub(crate) fn trial_table(&self, trials: &[KeptTrial]) -> Table {
        let study = self.study();
        let required = |name: &str, kind: Kind| Column { name: name.to_owned(), kind, optional: false };
        let optional = |name: &str, kind: Kind| Column { name: name.to_owned(), kind, optional: true };
        let mut columns: Vec<Column> = [("group", Kind::Text), ("session", Kind::Text), ("code", Kind::Text), ("hand", Kind::Text)]
            .into_iter()
            .chain([("row", Kind::Integer), ("number", Kind::Integer), ("position", Kind::Integer), ("condition", Kind::Integer)])
            .map(|(name, kind)| required(name, kind))
            .collect();
        columns.extend(study.factors.iter().map(|factor| required(&factor.column, factor.kind)));
        columns.extend([("trial", Kind::Integer), ("practice", Kind::Integer)].map(|(name, kind)| required(name, kind)));
        columns.push(optional("repeats", Kind::Integer));
        columns.extend([("valid", Kind::Integer), ("faults", Kind::Text), ("seed", Kind::Integer)].map(|(name, kind)| required(name, kind)));
        columns.extend([("outcome", Kind::Text), ("time_s", Kind::Number), ("late_ticks", Kind::Integer)].map(|(name, kind)| required(name, kind)));
        columns.extend(["round_trip_p50_s", "round_trip_p99_s"].map(|name| optional(name, Kind::Number)));
        // A measure can lack a value, for example the time of a task that timed out.
        columns.extend(study.measures.iter().map(|name| optional(name, Kind::Number)));
        let rows = trials.iter().flat_map(|trial| {
            let group = &self.groups()[trial.group];
            (0..study.group_size()).map(move |seat| trial_row(study, group, trial, seat))
        });
        Table { rows: rows.collect(), columns }
    }

    /// Returns the table of answers, a row per scale; the Task Load Index has a row for the mean of its scales too.
    pub(crate) fn answer_table(&self) -> Table {
        let study = self.study();
        let column = |name: &str, kind: Kind, optional: bool| Column { name: name.to_owned(), kind, optional };
        let mut columns: Vec<Column> = ["group", "session", "code", "hand", "after"].map(|name| column(name, Kind::Text, false)).into();
        // An answer about the study has no condition, so these columns and the factors may be empty, unlike in the table of trials.
        columns.extend(["position", "condition", "number"].map(|name| column(name, Kind::Integer, true)));
        columns.extend(study.factors.iter().map(|factor| column(&factor.column, factor.kind, true)));
        columns.extend([column("question", Kind::Text, false), column("scale", Kind::Text, false), column("value", Kind::Number, false)]);
        let rows = self.groups().iter().flat_map(|group| group.answers().iter().flat_map(move |answer| answer_rows(study, group, answer)));
        Table { rows: rows.collect(), columns }
    }
}

fn trial_row(study: &Study, group: &Group, trial: &KeptTrial, seat: usize) -> Row {
    let KeptTrial { ended: EndedTrial { plan, faults }, record, .. } = trial;
    let mut row = about_person(study, group, seat);
    row.extend([study.row_of(group.slot) + 1, plan.code.number, plan.position, plan.condition + 1].map(integer));
    row.extend(study.conditions[plan.condition].values.iter().cloned());
    row.extend([integer(plan.trial), flag(plan.practice), plan.repeats.map_or(Value::Absent, integer), flag(faults.is_empty())]);
    // The faults are those of the session: a repetition that was asked for later is not in the record.
    row.push(text(&faults.iter().map(|fault| fault.name()).collect::<Vec<_>>().join(" ")));
    // Seeds of trials have 53 bits, so the bound is never reached.
    row.push(Value::Integer(i64::try_from(plan.seed).unwrap_or(i64::MAX)));
    row.extend([text(&record.outcome), Value::Number(record.time_s), Value::Integer(i64::try_from(record.late_ticks).unwrap_or(i64::MAX))]);
    // A dry run has no browsers, so its list of round trips is empty and an index would panic.
    let round_trip = record.round_trips.get(seat).copied().flatten();
    row.extend([round_trip.map(|trip| trip.p50_s), round_trip.map(|trip| trip.p99_s)].map(number));
    row.extend(study.measures.iter().map(|name| number(record.value(name))));
    row
}

fn answer_rows(study: &Study, group: &Group, answer: &GivenAnswer) -> Vec<Row> {
    let question = &study.questions[answer.question];
    let after = match question.after {
        After::Trial => "trial",
        After::Condition => "condition",
        After::Study => "study",
    };
    let mut head = about_person(study, group, answer.seat);
    head.push(text(after));
    head.extend(
        [answer.position, answer.condition.map(|condition| condition + 1), answer.number].map(|number| number.map_or(Value::Absent, integer)),
    );
    match answer.condition {
        Some(condition) => head.extend(study.conditions[condition].values.iter().cloned()),
        None => head.extend(study.factors.iter().map(|_| Value::Absent)),
    }
    let row = |scale: &str, value: f64| {
        let mut row = head.clone();
        row.extend([text(&question.name), text(scale), Value::Number(value)]);
        row
    };
    let values: Vec<f64> = answer.values.iter().map(|value| f64::from(*value)).collect();
    match question.kind {
        QuestionKind::Scale { .. } => values.iter().map(|value| row(&question.name, *value)).collect(),
        QuestionKind::Tlx => {
            let scales = TLX.iter().zip(&values).map(|((name, ..), value)| row(name, *value));
            // The raw index is the plain mean: weights of the scales would need 15 comparisons of pairs more (Hart & Staveland 1988).
            scales.chain([row("raw", mean(&values))]).collect()
        }
    }
}

/// Returns the first cells of a row: group, state of the session, code and hand of the person.
fn about_person(study: &Study, group: &Group, seat: usize) -> Row {
    let code = group.code.person(seat, study.group_size());
    vec![text(&group.code.to_string()), text(group.state_name()), text(&code.to_string()), text(&study.hands[seat])]
}

/// Returns the mean of values; NaN for none.
#[expect(clippy::cast_precision_loss, reason = "few values")]
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn text(text: &str) -> Value {
    Value::Text(Arc::from(text))
}

fn integer(number: usize) -> Value {
    Value::Integer(i64::try_from(number).unwrap_or(i64::MAX))
}

const fn flag(is_so: bool) -> Value {
    Value::Integer(is_so as i64)
}

fn number(value: Option<f64>) -> Value {
    value.map_or(Value::Absent, Value::Number)
}
