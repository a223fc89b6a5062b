//! Pieces of the reports that are written as one HTML page which needs nothing else.

/// Text as it stands in HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The head of a page, and its first heading.
pub fn head(title: &str, heading: &str) -> String {
    format!(
        "<!doctype html><meta charset=\"utf-8\"><title>{}</title>\n<style>body{{font:15px sans-serif;margin:2em;\
         max-width:75em}}table{{border-collapse:collapse}}td,th{{border:1px solid #ccc;padding:2px 8px;text-align:left}}\
         img{{image-rendering:pixelated}}</style>\n<h1>{}</h1>\n",
        escape(title),
        escape(heading)
    )
}

/// A table with headings.
pub fn table<const N: usize>(headings: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    let heads: String = headings.map(|h| format!("<th>{}</th>", escape(h))).concat();
    let mut text = format!("<table><tr>{heads}</tr>\n");
    for row in rows {
        text += &format!("<tr>{}</tr>\n", row.map(|c| format!("<td>{}</td>", escape(&c))).concat());
    }
    text + "</table>\n"
}
