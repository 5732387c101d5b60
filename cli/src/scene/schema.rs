//! The schema of scene files, for editors.

use super::Scene;
use serde_json::{Value, json};

/// The JSON Schema of scene files. Any number may also be a formula or a number with a unit, in quotes.
///
/// ```
/// let schema = foible_cli::scene::schema();
/// assert_eq!(schema["title"], "Scene");
/// ```
pub fn schema() -> Value {
    let mut schema = serde_json::to_value(schemars::schema_for!(Scene)).unwrap_or(Value::Null);
    relax(&mut schema);
    schema
}

/// Numbers become numbers or text; text of the documentation loses its escapes.
fn relax(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            if let Some(Value::String(text)) = fields.get_mut("description") {
                *text = text.replace("\\[", "[").replace("\\]", "]");
            }
            let number = match fields.get("type") {
                Some(Value::String(kind)) => ["number", "integer"].contains(&kind.as_str()),
                Some(Value::Array(kinds)) => kinds.iter().any(|kind| kind == "number" || kind == "integer"),
                _ => false,
            };
            if number {
                let optional = fields["type"].is_array();
                for key in ["format", "minimum", "maximum"] {
                    fields.remove(key);
                }
                fields.insert(
                    "type".into(),
                    if optional { json!(["number", "string", "null"]) } else { json!(["number", "string"]) },
                );
            }
            fields.values_mut().for_each(relax);
        }
        Value::Array(values) => values.iter_mut().for_each(relax),
        _ => {}
    }
}
