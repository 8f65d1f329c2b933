//! The rows of a campaign as a table.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int64Array};
use cohaptic_campaign::{Column, Judgement, Kind, Row, SpreadCampaign, Value, Verdict};
use cohaptic_scene::schema::FileSchema;
use pyo3::prelude::*;

use crate::table::{Table, names};

/// Returns the value of a cell that Python holds.
pub(crate) fn value(cell: &Bound<'_, PyAny>, column: &Column) -> PyResult<Value> {
    if cell.is_none() {
        return Ok(Value::Absent);
    }
    Ok(match column.kind {
        Kind::Integer => Value::Integer(cell.extract()?),
        Kind::Number => Value::Number(cell.extract()?),
        Kind::Text => Value::Text(Arc::from(cell.extract::<String>()?)),
    })
}

/// Returns the rows of all runs as one table. The column of a varied key has the name of the key, and the unit of its values. Columns of verdicts follow
/// the columns of keys.
pub(crate) fn table(campaign: &SpreadCampaign, rows: &[Row], judgements: &[Judgement]) -> PyResult<Table> {
    let variations = campaign.variations();
    let column = |(place, column): (usize, &Column)| {
        let cells = rows.iter().map(|row| &row[place]);
        let varied = variations.iter().find(|varied| varied.column() == column.name);
        (varied.map_or_else(|| column.name.clone(), |varied| varied.key().to_owned()), array(column.kind, cells))
    };
    let mut columns: Vec<(String, ArrayRef)> = campaign.columns().iter().enumerate().map(column).collect();
    if !judgements.is_empty() {
        // The columns before the keys are the number of the run, the number of the combination, and the seed.
        let at = 3 + variations.len();
        columns.splice(at..at, verdicts(campaign, rows, judgements));
    }
    let unit =
        |name: &str| variations.iter().find(|varied| varied.key() == name).map(|varied| unit_of(varied.key(), varied.unit())).unwrap_or_default();
    Table::with_units(columns, unit)
}

/// Returns the columns of verdicts. Each row has the judgement of its combination.
fn verdicts(campaign: &SpreadCampaign, rows: &[Row], judgements: &[Judgement]) -> [(String, ArrayRef); 4] {
    let combination = campaign.columns().iter().position(|column| column.name == "combination").unwrap_or_default();
    let verdict = |row: &Row| match row[combination] {
        Value::Integer(place) => usize::try_from(place).ok().and_then(|place| judgements.get(place)).and_then(Judgement::verdict),
        Value::Absent | Value::Number(_) | Value::Text(_) => None,
    };
    // A combination without a verdict has empty cells, as in a file.
    let text =
        |of: fn(&Verdict) -> &Arc<str>| coded(rows.iter().map(|row| verdict(row).map_or_else(|| Arc::from(""), |verdict| of(verdict).clone())));
    let number =
        |of: fn(&Verdict) -> f64| -> ArrayRef { Arc::new(Float64Array::from_iter_values(rows.iter().map(|row| verdict(row).map_or(f64::NAN, of)))) };
    let columns = [
        ("verdict", text(|verdict| &verdict.word)),
        ("judged", text(|verdict| &verdict.judged)),
        ("radius", number(|verdict| verdict.radius)),
        ("error_bound", number(|verdict| verdict.error)),
    ];
    columns.map(|(name, column)| (name.to_owned(), column))
}

/// Returns the column with these cells. An absent number is NaN, and an absent text is empty. An integer is never absent.
fn array<'a>(kind: Kind, cells: impl Iterator<Item = &'a Value>) -> ArrayRef {
    match kind {
        Kind::Integer => Arc::new(Int64Array::from_iter_values(cells.map(|cell| if let Value::Integer(count) = cell { *count } else { 0 }))),
        Kind::Number => Arc::new(Float64Array::from_iter_values(cells.map(|cell| if let Value::Number(number) = cell { *number } else { f64::NAN }))),
        Kind::Text => coded(cells.map(|cell| if let Value::Text(text) = cell { text.clone() } else { Arc::from("") })),
    }
}

/// Returns the unit of the values of a key: the unit `carried` by all values, or else the unit in which the key takes plain numbers. Empty for a key
/// without a unit.
pub(crate) fn unit_of(key: &str, carried: &str) -> String {
    if carried.is_empty() { FileSchema::Scene.unit_of(key) } else { carried }.to_owned()
}

/// Returns a column of texts. Each different text is stored once, in the order of the first appearance.
fn coded(texts: impl Iterator<Item = Arc<str>>) -> ArrayRef {
    let mut known: Vec<String> = Vec::new();
    let codes = texts.map(|text| {
        let place = known.iter().position(|known| **known == *text).unwrap_or_else(|| {
            known.push(text.to_string());
            known.len() - 1
        });
        i32::try_from(place).unwrap_or(i32::MAX)
    });
    let codes = codes.collect();
    names(codes, known)
}
