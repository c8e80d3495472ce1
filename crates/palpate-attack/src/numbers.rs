//! Attacks by numbers: keys and paths that are not finite, out of range or in another unit.

use crate::attack::{Attack, Verdict, require};
use crate::child::Ended;
use crate::workplace::{Workplace, json};
use serde_json::Value;

/// The attacks.
pub const ATTACKS: &[Attack] = &[
    Attack { group: "numbers", name: "hostile values of every key of a scene", run: keys },
    Attack { group: "numbers", name: "paths that are not finite, sorted or in metres", run: paths },
    Attack { group: "numbers", name: "a held point at fixed nodes that is moved", run: held_at_fixed },
];

/// Largest number that may stand in the output of a scene of a body of 0.1 m and 0.1 kg.
const PLAUSIBLE: f64 = 1e12;

/// Whether all numbers are finite and plausible.
fn is_plausible(value: &Value) -> bool {
    match value {
        Value::Number(number) => number.as_f64().is_some_and(|number| number.abs() < PLAUSIBLE),
        Value::Array(values) => values.iter().all(is_plausible),
        Value::Object(values) => values.values().all(is_plausible),
        _ => true,
    }
}

/// Runs a scene: it must be refused with an error that names its file, or give numbers that are plausible or a warning.
fn run(workplace: &Workplace, scene: &str) -> Result<bool, String> {
    let Ended { code, printed, output } = workplace.run(&format!("run {scene} --duration 0.02 --json"))?;
    match code {
        Some(1 | 2) => Ok(false),
        Some(0) => {
            let report = json(&output)?;
            let warned = report["warnings"].as_array().is_some_and(|warnings| !warnings.is_empty());
            require(is_plausible(&report) || warned, || {
                format!("{scene}: implausible without a word: {report}")
            })?;
            Ok(true)
        }
        code => Err(format!("{scene} ended with {code:?}: {printed}")),
    }
}

fn keys(workplace: &Workplace) -> Verdict {
    let text = String::from_utf8_lossy(&workplace.read("fingers.toml")?).into_owned();
    let values = [
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1.0",
        "0.0",
        "1e-308",
        "\"x\"",
        "[]",
        "true",
        "9223372036854775807",
    ];
    let (mut refused, mut ran) = (0, 0);
    for (at, line) in text.lines().enumerate() {
        let Some((key, value)) = line.split_once(" = ") else { continue };
        for hostile in values {
            let mut with = vec![hostile.to_string()];
            // Each number inside of a list or table, too.
            let numbers = value.match_indices(|c: char| c.is_ascii_digit()).map(|(at, _)| at).take(1);
            for number in numbers {
                let end = value[number..].find([',', ']', ' ']).map_or(value.len(), |end| number + end);
                with.push(format!("{}{hostile}{}", &value[..number], &value[end..]));
            }
            for value in with {
                let lines = text.lines().enumerate();
                let changed =
                    lines.map(|(own, line)| if own == at { format!("{key} = {value}") } else { line.into() });
                workplace.write("hostile.toml", changed.collect::<Vec<_>>().join("\n"))?;
                match run(workplace, "hostile.toml").map_err(|what| format!("{key} = {value}: {what}"))? {
                    true => ran += 1,
                    false => refused += 1,
                }
            }
        }
    }
    Ok(format!("{refused} refused, {ran} ran with plausible numbers or a warning"))
}

fn paths(workplace: &Workplace) -> Verdict {
    let text = String::from_utf8_lossy(&workplace.read("fingers.toml")?).into_owned();
    workplace.write("of_path.toml", text.replace("left.csv", "hostile.csv"))?;
    let refused = [
        ("not a number", "0,nan,0,0\n1,0,0,0\n"),
        ("infinite", "0,0,0,0\n1,inf,0,0\n"),
        ("unsorted", "1,0,0,0\n0,0,0,0\n"),
        ("empty", ""),
        ("head only", "t,x,y,z\n"),
        ("columns", "0,0,0\n"),
        ("text", "0,a,b,c\n"),
    ];
    for (name, path) in refused {
        workplace.write("hostile.csv", path)?;
        let error = workplace.fail("run of_path.toml --duration 0.02 --json")?;
        require(error.contains("hostile.csv"), || format!("{name}: {error}"))?;
    }
    workplace.write("hostile.csv", "0,-80,0,50\n0.5,-52,0,50\n1,-52,0,50\n")?;
    let Ended { code, printed, .. } = workplace.run("run of_path.toml --duration 1.2 --json")?;
    require(code == Some(0) && printed.contains("millimetres"), || {
        format!("millimetres: {code:?} {printed}")
    })?;
    Ok(format!("{} refused by name, millimetres told", refused.len()))
}

fn held_at_fixed(workplace: &Workplace) -> Verdict {
    workplace.succeed(
        "record box:0.1x0.1x0.1/2x2x2 --order 1 --young 2000 --poisson 0.3 --density 110 --modes 10 --fix x<-0.049 -o fixed.palp",
    )?;
    workplace.write("pull.csv", "0,-0.05,0,0\n0.01,-0.06,0,0\n1,-0.06,0,0\n")?;
    let scene = "step = 0.001\n[[object]]\nname = \"cube\"\nrecording = \"fixed.palp\"\n[[device]]\nname = \"left\"\n\
                 mode = \"held\"\nattach = { object = \"cube\", point = [-0.05, 0.0, 0.0] }\npath = { file = \"pull.csv\" }\n";
    workplace.write("pull.toml", scene)?;
    let error = workplace.fail("run pull.toml --json")?;
    require(error.contains("left") && error.contains("fixed"), || error.clone())?;
    Ok(error)
}
