//! A bench as a trace of complete events, for Perfetto and `chrome://tracing`: the CPU's and the GPU's on one clock.

use serde_json::{Value, json};

use super::results::{BenchResult, Scope};

/// Thread of the frame loop.
const CPU: u32 = 1;
/// Thread of the device's queue.
const GPU: u32 = 2;

/// The trace of results that were measured in turn, each with what makes its setting another (empty for the first): a
/// process each, as all their times are from one start. Without calibrated timestamps a frame's GPU events begin at its
/// submission, and say so.
pub fn trace(results: &[(&BenchResult, &[String])]) -> Value {
    let mut events = Vec::new();
    for (&(result, knobs), process) in results.iter().zip(1..) {
        let setting: String = knobs.iter().map(|k| format!(" {k}")).collect();
        let names = [
            ("process_name", CPU, format!("canopy bench {}{setting}", result.scene.name)),
            ("thread_name", CPU, "frames (CPU)".into()),
            ("thread_name", GPU, format!("queue of {}", result.device.name)),
        ];
        events.extend(names.iter().map(|(what, thread, name)| named(what, *thread, name)));
        events.extend(frames(result));
        for event in events.iter_mut().filter(|e| e["pid"].is_null()) {
            event["pid"] = process.into();
        }
    }
    json!({ "displayTimeUnit": "ms", "traceEvents": events })
}

/// Events of a result's frames.
fn frames(result: &BenchResult) -> Vec<Value> {
    let mut events = Vec::new();
    for (k, f) in result.frames.iter().enumerate() {
        let arguments = json!({ "round": f.round, "view": f.view, "cpu_ms": f.cpu_ms, "draws": f.draws,
            "trees_zfield": f.trees_zfield, "calibrated": f.gpu_start_ms.is_some() });
        events.push(event(&format!("frame {k}"), CPU, f.start_ms, f.wall_ms(), arguments.clone()));
        events.push(event("stream", CPU, f.start_ms, f.stream_ms, json!({})));
        events.push(event("submit to done", CPU, f.submit_ms, f.done_ms - f.submit_ms, json!({})));
        let Some(gpu_ms) = f.gpu_ms else { continue };
        let start = f.gpu_start_ms.unwrap_or(f.submit_ms);
        events.push(event(&format!("frame {k}"), GPU, start, gpu_ms, arguments));
        // Whoever encloses comes first.
        for s in f.stages.iter().chain(&f.passes) {
            events.push(event(&s.name, GPU, start + s.start_ms, s.gpu_ms, arguments_of(s)));
        }
    }
    events
}

fn arguments_of(scope: &Scope) -> Value {
    json!({ "cpu_ms": scope.cpu_ms, "statistics": scope.statistics })
}

fn named(what: &str, thread: u32, name: &str) -> Value {
    json!({ "name": what, "ph": "M", "tid": thread, "args": { "name": name } })
}

/// A complete event; times in ms.
fn event(name: &str, thread: u32, start: f64, length: f64, arguments: Value) -> Value {
    json!({ "name": name, "cat": if thread == GPU { "gpu" } else { "cpu" }, "ph": "X", "tid": thread,
        "ts": 1e3 * start, "dur": 1e3 * length, "args": arguments })
}
