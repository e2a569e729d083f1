// Search from disk: browsers start no worker for a page whose address begins with `file:`, so there
// a hidden frame does the work of one. (The plug-in `offline` takes a script from the net for this.)
if (location.protocol === "file:") {
  const prelude = `
    window.importScripts = (...urls) => urls.reduce(
      (done, url) => done.then(() => new Promise((resolve, reject) => {
        const script = document.createElement("script")
        Object.assign(script, { src: url, onload: resolve, onerror: reject })
        document.body.append(script)
      })), Promise.resolve())
    window.postMessage = (data) => worker.dispatchEvent(new MessageEvent("message", { data }))`

  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      this.frame = document.createElement("iframe")
      this.frame.hidden = true
      document.body.append(this.frame)
      const inner = this.frame.contentWindow
      inner.worker = this
      this.ready = new Promise((resolve) => {
        const body = inner.document
        body.open()
        body.write(`<!doctype html><body><script>${prelude}</` + `script></body>`)
        body.close()
        inner.importScripts(url).then(resolve)
      })
      this.addEventListener("message", (event) => this.onmessage?.(event))
    }

    postMessage(data) {
      this.ready.then(() =>
        this.frame.contentWindow.dispatchEvent(new MessageEvent("message", { data })))
    }

    terminate() {
      this.frame.remove()
    }
  }
}
