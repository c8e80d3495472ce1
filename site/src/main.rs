//! `palpate-site BOOK OUTPUT`: the pages of a folder with a `book.toml` as a site, by mdBook.

use mdbook_driver::MDBook;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [book, output] = arguments.as_slice() else {
        eprintln!("palpate-site BOOK OUTPUT");
        return ExitCode::from(2);
    };
    let built = MDBook::load(book).and_then(|mut book| {
        book.config.build.build_dir = Path::new(output).to_path_buf();
        book.build()
    });
    match built {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("palpate-site: {error:#}");
            ExitCode::FAILURE
        }
    }
}
