// What the search of a site that Sphinx built answers, without a browser: node search.js HTML '["word", ...]'.
// Prints a JSON object: for each word the names of the pages found, best first.
const fs = require("fs"), vm = require("vm"), [, , html, words] = process.argv;
const nothing = () => null;
const context = {
  document: {
    addEventListener() {}, querySelector: nothing, getElementById: nothing, querySelectorAll: () => [],
    documentElement: { dataset: { content_root: "" } }, body: {}, readyState: "loading",
  },
  window: { location: { search: "" }, addEventListener() {} },
  DOCUMENTATION_OPTIONS: { URL_ROOT: "", FILE_SUFFIX: ".html", LINK_SUFFIX: ".html", BUILDER: "html" },
  SPHINX_HIGHLIGHT_ENABLED: false, localStorage: { getItem: nothing }, console, URLSearchParams,
};
vm.createContext(context);
for (const file of ["doctools", "base-stemmer", "english-stemmer", "language_data", "searchtools", "../searchindex"]) {
  const path = `${html}/_static/${file}.js`;
  if (file === "../searchindex")
    vm.runInContext('if (typeof Stemmer === "undefined") var Stemmer = EnglishStemmer;', context);
  vm.runInContext(fs.readFileSync(path, "utf8"), context, { filename: path });
}
context.words = JSON.parse(words);
const found = vm.runInContext(
  `Object.fromEntries(words.map((word) => {
    const [query, terms, excluded, highlight, objects] = Search._parseQuery(word);
    return [word, Search._performSearch(query, terms, excluded, highlight, objects).reverse().map((hit) => hit[0])];
  }))`, context);
console.log(JSON.stringify(found));
