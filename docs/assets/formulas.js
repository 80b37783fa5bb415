/* SPDX-License-Identifier: MIT */
// Formulas, which arithmatex has marked, set by KaTeX from the site itself.
for (const formula of document.querySelectorAll(".arithmatex")) {
  const latex = formula.textContent.trim().replace(/^\\[([]|\\[)\]]$/g, "");
  katex.render(latex, formula, { displayMode: formula.tagName === "DIV", throwOnError: false });
}
