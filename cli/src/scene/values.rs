//! Values that a scene gives otherwise than as plain numbers: parameters, formulas and units.

use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

type Mistake = super::mistake::Mistake;

/// Units that a value in quotes may have, in the SI unit of its kind.
const UNITS: [(&str, f64); 46] = [
    ("m", 1.0),
    ("cm", 1e-2),
    ("mm", 1e-3),
    ("um", 1e-6),
    ("km", 1e3),
    ("in", 0.0254),
    ("ft", 0.3048),
    ("kg", 1.0),
    ("g", 1e-3),
    ("t", 1e3),
    ("lb", 0.453_592_37),
    ("s", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("min", 60.0),
    ("h", 3600.0),
    ("Hz", 1.0),
    ("1/s", 1.0),
    ("N", 1.0),
    ("mN", 1e-3),
    ("kN", 1e3),
    ("lbf", 4.448_221_615_260_5),
    ("Pa", 1.0),
    ("kPa", 1e3),
    ("MPa", 1e6),
    ("GPa", 1e9),
    ("bar", 1e5),
    ("psi", 6_894.757_293_168),
    ("J", 1.0),
    ("mJ", 1e-3),
    ("kJ", 1e3),
    ("Ns", 1.0),
    ("N s", 1.0),
    ("N m", 1.0),
    ("m/s", 1.0),
    ("cm/s", 1e-2),
    ("mm/s", 1e-3),
    ("km/h", 1.0 / 3.6),
    ("m/s2", 1.0),
    ("m/s²", 1.0),
    ("kg/m3", 1.0),
    ("kg/m³", 1.0),
    ("g/cm3", 1e3),
    ("deg", 1.0),
    ("rad", 180.0 / std::f64::consts::PI),
    ("%", 1e-2),
];

/// Keys whose strings name things, whatever they look like.
pub fn is_name(key: &str) -> bool {
    [
        "name",
        "of",
        "on",
        "minus",
        "between",
        "deformable",
        "to",
        "path",
        "column",
        "members",
        "release",
        "cut",
    ]
    .contains(&key)
}

/// A number with a unit; nothing if it is none.
pub fn with_unit(text: &str) -> Option<Result<f64, String>> {
    let text = text.trim();
    let digits = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    if !text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        return None;
    }
    // The longest start that is a number: an "e" may begin a unit.
    let end = text.find(|c| !digits(c)).unwrap_or(text.len());
    let end = (1..=end).rev().find(|end| text[..*end].parse::<f64>().is_ok())?;
    let (number, unit) = (text[..end].parse::<f64>().ok()?, text[end..].trim());
    if unit.is_empty() {
        return Some(Ok(number));
    }
    let known = UNITS.iter().find(|(name, _)| *name == unit);
    Some(known.map(|(_, factor)| number * factor).ok_or_else(|| {
        let names: Vec<&str> = UNITS.iter().map(|(name, _)| *name).collect();
        format!("\"{unit}\" is no unit that is known; there are: {}", names.join(", "))
    }))
}

/// Names that formulas have for themselves.
const CONSTANTS: [&str; 6] = ["PI", "π", "E", "e", "TAU", "τ"];

/// Numbers like 9e-4 written out: the library of formulas takes the e for Euler's number.
fn written_out(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit() || c == '.') {
        let (before, number) = rest.split_at(start);
        out.push_str(before);
        let is_name = out.ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let digits = number.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(number.len());
        let power =
            number[digits..].strip_prefix(['e', 'E']).map(|p| p.strip_prefix(['+', '-']).unwrap_or(p));
        let places = power.map_or(0, |p| p.find(|c: char| !c.is_ascii_digit()).unwrap_or(p.len()));
        let end = if places == 0 { digits } else { number.len() - power.map_or(0, str::len) + places };
        match number[..end].parse::<f64>() {
            Ok(value) if places > 0 && !is_name => out.push_str(&format!("{value}")),
            _ => out.push_str(&number[..end]),
        }
        rest = &number[end..];
    }
    out + rest
}

/// A formula over named values.
fn formula(text: &str, values: &BTreeMap<String, String>) -> Result<f64, String> {
    use exmex::Express;
    // Its parser recurses: a formula is not to be a stack overflow.
    if text.len() > 500 {
        return Err("this formula is longer than 500 characters".into());
    }
    let text = written_out(text);
    let parsed =
        std::panic::catch_unwind(|| exmex::parse::<f64>(&text)).map_err(|_| "is no formula".to_string())?;
    let parsed = parsed.map_err(|error| format!("is no formula: {error}"))?;
    let number = |name: &String| {
        let text = values.get(name).ok_or_else(|| {
            let known: Vec<String> = values.keys().cloned().collect();
            format!("is no parameter; {}", super::mistake::none_such(name, &known))
        })?;
        text.parse::<f64>().map_err(|_| format!("\"{name}\" is {text}, which is no number"))
    };
    let names: Vec<f64> = parsed.var_names().iter().map(number).collect::<Result<_, _>>()?;
    let value = parsed.eval(&names).map_err(|error| error.to_string())?;
    if value.is_finite() { Ok(value) } else { Err(format!("this formula gives {value}")) }
}

/// The parameters of a scene, each as it stands in the file, or as it was set.
#[derive(Clone, Debug, Default)]
pub struct Parameters {
    texts: BTreeMap<String, (Range<usize>, String)>,
}

/// What the parameters come to, each as a literal of TOML.
#[derive(Clone, Debug, Default)]
pub struct Values(BTreeMap<String, String>);

impl Parameters {
    /// Those of the scene's own file, and of included ones where it has none of the name.
    pub fn read(table: &DeTable<'_>, text: &str) -> Result<Self, Mistake> {
        let mut found = Self::default();
        let Some(own) = table.get("parameters") else { return Ok(found) };
        let Some(own_table) = own.get_ref().as_table() else {
            return Err((own.span(), "`parameters` must be a table".into()));
        };
        found.take(own_table, text)?;
        for (_, value) in own_table.iter() {
            if let Some(included) = value.get_ref().as_table() {
                found.take(included, text)?;
            }
        }
        Ok(found)
    }

    fn take(&mut self, table: &DeTable<'_>, text: &str) -> Result<(), Mistake> {
        for (key, value) in table.iter().filter(|(_, value)| value.get_ref().as_table().is_none()) {
            if CONSTANTS.contains(&key.get_ref().as_ref()) {
                let what =
                    format!("`{}` is a number of its own in formulas; take another name", key.get_ref());
                return Err((key.span(), what));
            }
            let own = match value.get_ref() {
                DeValue::String(own) => own.to_string(),
                _ => text[value.span()].to_string(),
            };
            self.texts.entry(key.get_ref().to_string()).or_insert((value.span(), own));
        }
        Ok(())
    }

    /// Whether there is such a parameter; then it is set.
    pub fn set(&mut self, name: &str, value: &str) -> bool {
        self.texts.get_mut(name).map(|(_, own)| *own = value.to_string()).is_some()
    }

    /// Every parameter's value; those that are formulas may name others.
    pub fn resolved(&self) -> Result<Values, Mistake> {
        let mut known = BTreeMap::new();
        let mut left: Vec<_> = self.texts.iter().collect();
        loop {
            let before = left.len();
            let mut mistake = None;
            left.retain(|(name, (at, text))| match Values::value(text, &known) {
                Ok(value) => {
                    known.insert((*name).clone(), value);
                    false
                }
                Err(what) => {
                    mistake = Some((at.clone(), format!("parameter `{name}`: {what}")));
                    true
                }
            });
            match mistake {
                None => return Ok(Values(known)),
                Some(mistake) if left.len() == before => return Err(mistake),
                Some(_) => {}
            }
        }
    }
}

impl Values {
    fn value(text: &str, known: &BTreeMap<String, String>) -> Result<String, String> {
        if let Some(text) = text.strip_prefix('=') {
            return formula(text, known).map(number);
        }
        match with_unit(text) {
            Some(value) => value.map(number),
            None => Ok(literal(text)),
        }
    }

    /// A value of a command line as TOML, units and formulas resolved, in lists too.
    pub fn literal(&self, text: &str) -> Result<String, String> {
        if let Ok(list) = DeValue::parse(text)
            && let Some(values) = list.get_ref().as_array()
        {
            let value = |value: &Spanned<DeValue<'_>>| self.literal(&text[value.span()]);
            let values: Vec<String> = values.iter().map(value).collect::<Result<_, _>>()?;
            return Ok(format!("[{}]", values.join(", ")));
        }
        let bare = text.trim_matches('"');
        Ok(self.replacement(bare)?.unwrap_or_else(|| literal(text)))
    }

    /// What stands for a string of the scene; nothing if it stands for itself.
    pub fn replacement(&self, text: &str) -> Result<Option<String>, String> {
        if let Some(text) = text.strip_prefix('=') {
            if let Some(own) = self.0.get(text.trim()) {
                return Ok(Some(own.clone()));
            }
            return formula(text, &self.0).map(|value| Some(number(value)));
        }
        with_unit(text).map(|value| value.map(number)).transpose()
    }
}

/// A number as TOML writes it: whole ones as integers, which every number of a scene may be.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value:.0}") } else { format!("{value:e}") }
}

/// A value of a command line as TOML: as it stands if it is one, quoted if not.
pub fn literal(text: &str) -> String {
    if DeValue::parse(text).is_ok() { text.to_string() } else { toml::Value::from(text).to_string() }
}

/// Where a value is put in, and what goes around it.
#[derive(Debug)]
pub struct Place {
    pub at: Range<usize>,
    pub before: String,
    pub after: String,
}

/// The place of a dotted path, `deformable.foam.material.density`; entries of lists go by their `name` or number, those
/// of vectors by their axis too: `rigid.box.translation.y`.
pub fn place_of(table: &DeTable<'_>, text: &str, path: &str) -> Result<Place, String> {
    let mut keys: Vec<&str> = path.split('.').collect();
    let last = keys.pop().unwrap_or_default();
    let mut table = table;
    // Of an inline table, where it is.
    let mut own: Option<Range<usize>> = None;
    let mut so_far = Vec::new();
    let mut keys = keys.into_iter();
    while let Some(key) = keys.next() {
        so_far.push(key);
        let names = || table.keys().map(|k| k.get_ref().to_string()).collect::<Vec<_>>();
        let value = table.get(key).ok_or_else(|| super::mistake::none_such(&so_far.join("."), &names()))?;
        let mut value = value;
        let mut is_named = false;
        while let DeValue::Array(entries) = value.get_ref()
            && !is_named
        {
            let which = keys.next();
            is_named = which.is_none();
            so_far.push(which.unwrap_or(last));
            value = entry(entries, which.unwrap_or(last))
                .ok_or_else(|| super::mistake::none_such(&so_far.join("."), &entry_names(entries)))?;
        }
        if is_named {
            let is_value = !value.get_ref().is_table() && !value.get_ref().is_array();
            let place = Place { at: value.span(), before: String::new(), after: String::new() };
            return is_value
                .then_some(place)
                .ok_or_else(|| "is no number or text; name what is in it".into());
        }
        own = Some(value.span());
        table = value.get_ref().as_table().ok_or_else(|| format!("`{}` is no table", so_far.join(".")))?;
    }
    if let Some(value) = table.get(last) {
        return Ok(Place { at: value.span(), before: String::new(), after: String::new() });
    }
    let Some(own) = own else {
        let names: Vec<String> = table.keys().map(|k| k.get_ref().to_string()).collect();
        return Err(format!("is no parameter; {}", super::mistake::none_such(last, &names)));
    };
    let inline = Some(own).filter(|at| text[at.clone()].starts_with('{'));
    if let Some(at) = inline {
        let (close, comma) = (at.end - 1, if table.is_empty() { "" } else { ", " });
        return Ok(Place { at: close..close, before: format!("{comma}{last} = "), after: " ".into() });
    }
    let first =
        table.values().filter(|value| !value.get_ref().is_table()).map(|value| value.span().end).min();
    let Some(end) = first else { return Err(format!("`{path}` is not there, and nothing beside it")) };
    Ok(Place { at: end..end, before: format!("\n{last} = "), after: String::new() })
}

fn name_of<'a>(entry: &'a Spanned<DeValue<'_>>) -> Option<&'a str> {
    entry.get_ref().as_table()?.get("name")?.get_ref().as_str()
}

fn entry<'a, 'i>(entries: &'a [Spanned<DeValue<'i>>], which: &str) -> Option<&'a Spanned<DeValue<'i>>> {
    let named = entries.iter().find(|entry| name_of(entry) == Some(which));
    // Of a vector, by its axis too.
    let is_vector = entries.len() == 3 && entries.iter().all(|entry| !entry.get_ref().is_table());
    let axis = || ["x", "y", "z"].iter().position(|axis| is_vector && *axis == which);
    named.or_else(|| entries.get(which.parse::<usize>().ok().or_else(axis)?))
}

fn entry_names(entries: &[Spanned<DeValue<'_>>]) -> Vec<String> {
    let names = entries.iter().enumerate();
    names.map(|(k, entry)| name_of(entry).map_or(k.to_string(), String::from)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_know_powers_of_ten_and_parameters() {
        let values = BTreeMap::from([("height".to_string(), "2.5".to_string()), ("e2".into(), "7".into())]);
        let of = |text: &str| formula(text, &values);
        assert_eq!(of("2*height + 1e-3"), Ok(5.001));
        assert_eq!(of("1.5E3 - .5e+1"), Ok(1495.0));
        assert_eq!(of("e2*2"), Ok(14.0));
        assert!((of("exp(1) - e").unwrap()).abs() < 1e-12);
        assert!((of("(1 + 3)^0.5 - sqrt(4)").unwrap()).abs() < 1e-12);
        for wrong in ["2*hight", "1/0", "2 +", "", "((", "1e999"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
        assert!(of("2*hight").unwrap_err().contains("height"));
        assert!(of(&"(".repeat(10_000)).is_err());
    }

    #[test]
    fn units_are_those_of_the_si() {
        assert_eq!(with_unit("5 cm"), Some(Ok(0.05)));
        assert_eq!(with_unit("0.3MPa"), Some(Ok(0.3e6)));
        assert_eq!(with_unit("-2e-3 m"), Some(Ok(-2e-3)));
        assert_eq!(with_unit("1e3"), Some(Ok(1e3)));
        assert!(with_unit("5 parsec").unwrap().unwrap_err().contains("MPa"));
        assert_eq!(with_unit("floor"), None);
        assert_eq!(with_unit("-"), None);
    }
}
