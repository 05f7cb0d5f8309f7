import { defineConfig, type Plugin } from "vite";

/** Put the one script and the one style into the page, so that it is one file that asks for nothing. */
function oneFile(): Plugin {
  return {
    name: "one-file",
    enforce: "post",
    generateBundle(_, bundle) {
      const page = bundle["index.html"];
      if (page?.type !== "asset") throw new Error("no index.html was built");
      let html = String(page.source).replace(/\s*<(script[^>]*src=|link rel="stylesheet")[^>]*>(<\/script>)?/g, "");
      for (const [name, part] of Object.entries(bundle)) {
        if (part.type === "chunk") html = before(html, "</body>", `<script type="module">${inScript(part.code)}</script>\n`);
        else if (name.endsWith(".css")) html = before(html, "</head>", `<style>${String(part.source)}</style>\n`);
        if (name !== "index.html") delete bundle[name];
      }
      page.source = html;
    },
  };
}

const before = (html: string, mark: string, text: string) => html.replace(mark, () => text + mark);

/** Return code that cannot end its script element. */
const inScript = (code: string) => code.trim().replace(/<\/(script)/gi, "<\\/$1").replace(/<!--/g, "<\\!--");

export default defineConfig({
  base: "./",
  plugins: [oneFile()],
  oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
  build: {
    outDir: "../khala_sc2/view/assets",
    emptyOutDir: true,
    target: "es2023",
    modulePreload: false,
    cssCodeSplit: false,
    assetsInlineLimit: 1_000_000,
  },
  test: { environment: "node" },
} as Parameters<typeof defineConfig>[0]);
