//! Names in JSON, for tests that keep them.

use std::collections::BTreeSet;

use serde_json::Value;

/// Every key by its path, a line each: lists count as one `[]`, and tables whose keys are names of things (`named`) as one `*`.
pub fn keys(value: &Value, named: &[&str]) -> String {
    let mut found = BTreeSet::new();
    collect(value, "", named, &mut found);
    found.into_iter().map(|k| k + "\n").collect()
}

fn collect(value: &Value, path: &str, named: &[&str], found: &mut BTreeSet<String>) {
    match value {
        // A table that happens to be empty here is one all the same.
        Value::Object(all) if all.is_empty() => {
            found.insert(format!("{}.*", path.trim_start_matches('.')));
        }
        Value::Object(all) => {
            let things = path.rsplit('.').next().is_some_and(|last| named.contains(&last));
            for (k, v) in all {
                collect(v, &format!("{path}.{}", if things { "*" } else { k }), named, found);
            }
        }
        Value::Array(all) if all.iter().any(|v| v.is_object()) => {
            all.iter().for_each(|v| collect(v, &format!("{path}[]"), named, found));
        }
        _ => {
            found.insert(path.trim_start_matches('.').to_string());
        }
    }
}
