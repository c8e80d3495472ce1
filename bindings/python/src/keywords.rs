//! Keywords of Python in place of the command line's options, in messages.

/// Keywords whose options of the command line stand in messages.
const KEYWORDS: [&str; 12] = [
    "young",
    "poisson",
    "density",
    "material",
    "modes",
    "order",
    "scale",
    "cell_size",
    "fix",
    "spring",
    "merge_nodes",
    "piece",
];

/// Message with keywords in place of options: `cell_size` for `--cell-size`, `scale=0.001` for `--scale 0.001`.
pub fn keywords_in(message: &str) -> String {
    // A path may have two hyphens inside.
    let mut message = format!(" {message}");
    for keyword in KEYWORDS {
        let option = format!("--{}", keyword.replace('_', "-"));
        for before in [" ", "("] {
            for digit in 0..10 {
                let (given, said) =
                    (format!("{before}{option} {digit}"), format!("{before}{keyword}={digit}"));
                message = message.replace(&given, &said);
            }
            message = message.replace(&format!("{before}{option}"), &format!("{before}{keyword}"));
        }
    }
    message.split_off(1)
}
