//! Sound of bodies that are struck, against closed forms and recorded frequencies.

mod closed_form;
mod held;
mod listening;
mod struck;
mod studio;
