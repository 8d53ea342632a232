//! Pictures against closed forms.
