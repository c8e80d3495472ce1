//! Site: the pages of `docs/` as one book, and the API's documentation in its folder `api`.
//!
//! ```text
//! docs/*.md, ARCHITECTURE.md, … → book::stage → target/site-source → site/ (mdBook) → target/site → built::check
//! cargo doc                     → target/doc                                        → target/site/api
//! ```
//!
//! Pages keep the addresses that GitHub's readers follow; staging turns those that lead out of `docs/` into addresses of the site.

pub mod book;
pub mod built;
pub mod links;
pub mod markdown;
