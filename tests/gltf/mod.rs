//! stub
mod real;
