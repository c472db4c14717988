{
  const figures = [...document.querySelectorAll("figure.view")];
  const choice = document.querySelector(".choice");
  if (choice) {
    const buttons = [...choice.children];
    const show = chosen => {
      figures.forEach((one, k) => { one.hidden = k !== chosen; });
      buttons.forEach((one, k) => one.setAttribute("aria-pressed", k === chosen));
    };
    choice.hidden = false;
    choice.addEventListener("click", event => {
      const chosen = buttons.indexOf(event.target);
      if (chosen >= 0) show(chosen);
    });
    show(0);
  }
  // None where the page stands alone, or in a page of another origin.
  const frame = window.frameElement;
  if (frame) {
    const root = document.documentElement, outside = frame.ownerDocument;
    const dark = [...document.styleSheets[0].cssRules]
      .find(one => one.media && one.media.mediaText.includes("prefers-color-scheme"));
    const paper = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
    const behind = () => {
      for (let one = frame.parentElement; one; one = one.parentElement || one.getRootNode().host) {
        paper.clearRect(0, 0, 1, 1);
        paper.fillStyle = getComputedStyle(one).backgroundColor;
        paper.fillRect(0, 0, 1, 1);
        const [red, green, blue, opaque] = paper.getImageData(0, 0, 1, 1).data;
        if (opaque > 127) return 0.299 * red + 0.587 * green + 0.114 * blue;
      }
      return null;
    };
    // In the scheme of the page around it, which need not be that of the browser.
    const match = () => {
      const light = behind();
      if (light === null) return;
      dark.media.mediaText = light < 128 ? "screen" : "not all";
      root.style.colorScheme = frame.style.colorScheme = light < 128 ? "dark" : "light";
      document.body.classList.add("within");
    };
    const still = frame.previousElementSibling;
    if (still && still.tagName === "IMG") still.style.display = "none";
    frame.style.position = "static";
    const fit = () => {
      const height = Math.ceil(document.body.getBoundingClientRect().height);
      // None while the frame is not laid out.
      if (height) frame.style.height = `${height}px`;
    };
    fit();
    new ResizeObserver(fit).observe(document.body);
    match();
    const changes = new MutationObserver(() => {
      if (!frame.isConnected) changes.disconnect();
      // Styles of a scheme are loaded after its name is set.
      else setTimeout(match, 300);
    });
    for (const one of [outside.documentElement, outside.body]) {
      changes.observe(one, {attributes: true});
    }
  }
}
