#include <algorithm>
#include <sstream>

#include "trunnion/base/number_text.hpp"
#include "trunnion/report/page.hpp"

#include "report/assets.hpp"
#include "report/json_text.hpp"
#include "report/packed.hpp"
#include "report/page_data.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

const char* tone_class(Tone tone) {
  return tone == Tone::good ? "good" : tone == Tone::bad ? "bad" : "neutral";
}
// A sign beside the colour, for those who cannot tell the colours.
const char* tone_sign(Tone tone) {
  return tone == Tone::good ? "&#10003; " : tone == Tone::bad ? "&#10007; " : "";
}

struct Count {
  std::size_t all = 0;
  std::size_t drawn = 0;
  void take(const std::vector<double>& values, std::size_t most) {
    all += values.size();
    drawn += thinned(values, most).size();
  }
};

// "6000 of 100000 points drawn, ..." when a figure had to be thinned.
std::string thinning_note(const Figure& figure) {
  Count count;
  if (const auto* xy = std::get_if<XyPlot>(&figure.plot)) {
    for (const Series& s : xy->series) count.take(s.y, kDrawnFlat);
  } else if (const auto* space = std::get_if<SpacePlot>(&figure.plot)) {
    count.take(space->value, kDrawnSpace);
  }
  if (count.all == count.drawn) return "";
  return " Drawn: " + std::to_string(count.drawn) + " of " + std::to_string(count.all) +
         " points; the smallest and the largest of every stretch are among them.";
}

std::string html_of(const Paragraph& paragraph) {
  return "<p>" + escaped(paragraph.text) + "</p>\n";
}

// A figure without a neighbour takes the whole row, but for a matrix and a circle: they are square.
bool stands_alone(const std::vector<Item>& items, std::size_t at) {
  const auto is_figure = [&](std::size_t i) { return std::holds_alternative<Figure>(items[i]); };
  if (!is_figure(at)) return false;
  std::size_t first = at;
  while (first > 0 && is_figure(first - 1)) --first;
  const bool last = at + 1 == items.size() || !is_figure(at + 1);
  const auto& plot = std::get<Figure>(items[at]).plot;
  const auto* flat = std::get_if<XyPlot>(&plot);
  return last && (at - first) % 2 == 0 &&
         (std::holds_alternative<SpacePlot>(plot) || (flat != nullptr && !flat->equal_scales));
}

std::string html_of(const Figure& figure) {
  const bool space = std::holds_alternative<SpacePlot>(figure.plot);
  const bool matrix = std::holds_alternative<MatrixPlot>(figure.plot);
  return "<figure id=\"" + figure.id +
         (space    ? "\" class=\"space"
          : matrix ? ""
                   : "\" class=\"flat") +
         "\" data-figure=\"" + figure.id + "\"><h3>" + escaped(figure.title) +
         "</h3><div class=\"plot\"><div class=\"live\" hidden></div><div class=\"still\">" + svg_of(figure) +
         "</div></div><figcaption>" + escaped(figure.caption + thinning_note(figure)) +
         "</figcaption></figure>\n";
}

// A path may break behind each folder.
std::string cell_of(const std::string& text) {
  std::string out;
  for (const char c : escaped(text)) {
    out += c;
    if (c == '/') out += "<wbr>";
  }
  return out;
}

// What the columns take on paper at the least, in its letters, px: no word and no number is broken.
double paper_width(const Table& table) {
  constexpr double kBold = 7.0, kPlain = 6.3, kPadding = 8.0;
  const auto longest_word = [](const std::string& text) {
    std::istringstream words(text);
    std::size_t out = 0;
    for (std::string word; words >> word;) out = std::max(out, word.size());
    return static_cast<double>(out);
  };
  double out = 0.0;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    double widest = kBold * longest_word(table.columns[c]);
    for (const auto& row : table.rows)
      if (c < row.size() && row[c].find('/') == std::string::npos)
        widest = std::max(widest, kPlain * longest_word(row[c]));
    out += widest + kPadding;
  }
  return out;
}

std::string html_of(const Table& table) {
  constexpr double kPaper = 678.0;       // A4 within its margins: a wider table stands in smaller letters
  constexpr std::size_t kLongCell = 30;  // letters: a column of sentences is not squeezed to a word a line
  std::string out =
      "<figure class=\"table\" id=\"" + table.id + "\"><h3>" + escaped(table.title) +
      "</h3><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" + escaped(table.title) +
      (paper_width(table) > kPaper ? "\"><table class=\"wide\">" : "\"><table>") + "<thead><tr>";
  const auto cell_class = [&](std::size_t c) {
    return c < table.numeric.size() && table.numeric[c] ? " class=\"number\"" : "";
  };
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    out += "<th scope=\"col\"" + std::string(cell_class(c)) + ">" + escaped(table.columns[c]) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    out += "<tr>";
    for (std::size_t c = 0; c < table.rows[r].size(); ++c) {
      const bool button = c == 0 && r < table.go_to.size();
      const bool words = table.rows[r][c].size() > kLongCell;
      out += "<td" + std::string(words ? " class=\"words\"" : cell_class(c)) + ">" +
             (button ? "<button type=\"button\" data-stop=\"" + std::to_string(table.go_to[r]) + "\">" : "") +
             cell_of(table.rows[r][c]) + (button ? "</button>" : "") + "</td>";
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div><figcaption>" + escaped(table.caption) + "</figcaption></figure>\n";
}

std::string html_of(const Listing& listing) {
  return "<figure class=\"table\" id=\"" + listing.id + "\"><h3>" + escaped(listing.title) +
         "</h3><pre class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" + escaped(listing.title) +
         "\">" + escaped(listing.text) + "</pre></figure>\n";
}

std::string html_of(const Scene& scene) {
  return "<figure id=\"scene\" class=\"scene\"><h3>" + escaped(scene.title) +
         "</h3><div class=\"stage\" hidden></div><div class=\"plot still\">" + svg_of(scene) +
         "</div><p class=\"why-still\">The 3-D view needs JavaScript and WebGL 2; this is a still "
         "picture.</p><figcaption>" +
         escaped(scene.caption) + "</figcaption></figure>\n";
}

std::string facts_html(const Page& page) {
  if (page.facts.empty()) return "";
  constexpr std::size_t kLongFact = 40;  // letters: a sentence gets a row of its own
  std::string out = "<dl class=\"facts\">";
  // Those of a row of their own come last: they leave no holes among the others.
  std::vector<Fact> facts = page.facts;
  const auto is_short = [](const Fact& fact) { return fact.text.size() <= kLongFact; };
  std::stable_partition(facts.begin(), facts.end(), is_short);
  for (const Fact& fact : facts) {
    const bool is_long = !is_short(fact);
    out += std::string(is_long ? "<div class=\"long\">" : "<div>") + "<dt>" + escaped(fact.label) +
           "</dt><dd data-fact=\"" + escaped(fact.id) + "\"" +
           (fact.value ? " data-value=\"" + shortest_text(*fact.value) + "\"" : "") + ">" +
           escaped(fact.text) + "</dd></div>";
  }
  return out + "</dl>\n";
}

std::string navigation(const Page& page) {
  std::string out = "<nav aria-label=\"Sections\">";
  for (std::size_t i = 0; i < page.sections.size(); ++i)
    out += "<a href=\"#section-" + std::to_string(i + 1) + "\">" + escaped(page.sections[i].title) + "</a> ";
  return out + "<button type=\"button\" id=\"theme\">light / dark</button></nav>\n";
}

std::string body(const Page& page) {
  std::string out = "<a class=\"skip\" href=\"#main\">to the results</a>\n<header><h1>" +
                    escaped(page.title) + "</h1>\n<p id=\"verdict\" class=\"verdict " +
                    tone_class(page.tone) + "\">" + tone_sign(page.tone) + escaped(page.verdict) + "</p>\n" +
                    navigation(page) + "</header>\n<main id=\"main\" tabindex=\"-1\">\n" + facts_html(page);
  bool steps = false;  // within a story
  for (std::size_t i = 0; i < page.sections.size(); ++i) {
    const std::string id = "section-" + std::to_string(i + 1);
    if (page.sections[i].step != steps) {
      steps = !steps;
      out += steps ? "<div class=\"story\">\n" : "</div>\n";
    }
    out += "<section id=\"" + id + "\" aria-labelledby=\"" + id + "-title\"><h2 id=\"" + id + "-title\">" +
           escaped(page.sections[i].title) + "</h2>\n";
    const std::vector<Item>& items = page.sections[i].items;
    for (std::size_t k = 0; k < items.size(); ++k) {
      const bool alone = stands_alone(items, k);
      out += alone ? "<div class=\"alone\">" : "";
      out += std::visit([](const auto& it) { return html_of(it); }, items[k]);
      out += alone ? "</div>\n" : "";
    }
    out += "</section>\n";
  }
  if (steps) out += "</div>\n";
  out += "</main>\n<footer><p>" + escaped(page.made_by) + "</p>";
  if (!has_interactive_charts())
    out += "<p>The program was built without the chart library: the plots of this page do not move.</p>";
  return out + "</footer>\n";
}

std::string script(std::string_view attributes, std::string_view text) {
  return "<script" + std::string(attributes) + ">" + std::string(text) + "</script>\n";
}

}  // namespace

bool has_interactive_charts() {
  return !chart_library().empty();
}

std::string page_html(const Page& page) {
  // The policy is the promise that nothing is fetched or sent, kept by the browser.
  std::string out =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
      "script-src 'unsafe-inline'; img-src data: blob:; "
      "connect-src 'none'; form-action 'none'; base-uri 'none'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>" +
      escaped(page.title) + "</title>\n<style>\n" + std::string(style_sheet()) +
      "</style>\n</head>\n<body>\n" + body(page);
  const std::string json_type = " type=\"application/json\" id=\"";
  out += script(json_type + "result\"", script_text(page.result_json.empty() ? "null" : page.result_json));
  // In pieces, which the page's script takes when they are needed: a large program's numbers are megabytes.
  const auto data = page_data(page);
  const auto put = [&](const std::string& name, const nlohmann::ordered_json& piece) {
    out += script(json_type + "data-" + name + "\"", script_text(json_text(piece, -1)));
  };
  for (const auto& [id, figure] : data["figures"].items()) put(id, figure);
  if (data.contains("scene")) put("scene", data["scene"]);
  // Not run before the first chart is near the window.
  if (has_interactive_charts()) out += script(" type=\"text/plain\" id=\"charts\"", packed(chart_library()));
  out += script("", page_script());
  return out + "</body>\n</html>\n";
}

}  // namespace trunnion::report
