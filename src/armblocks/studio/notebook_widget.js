// The page's views in a notebook, by the protocol of anywidget (https://anywidget.dev). They live in a frame, so that
// neither the notebook's styles reach them nor theirs the notebook; all that they need comes with the widget.

const isDark = () => {
  const { classList, dataset } = document.body
  if (dataset.jpThemeLight !== undefined) return dataset.jpThemeLight === 'false' // JupyterLab
  if (classList.contains('vscode-dark') || classList.contains('vscode-light')) return classList.contains('vscode-dark')
  return matchMedia('(prefers-color-scheme: dark)').matches
}

const bytes = (view) => view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength)

function render({ model, el }) {
  const frame = document.createElement('iframe')
  frame.title = model.get('title')
  frame.style.cssText = `display: block; width: 100%; height: ${model.get('height')}px; border: 0`
  const say = (message) => frame.contentWindow?.postMessage(message, '*')
  const show = () => say({ ...model.get('_shown'), kind: 'show', dark: isDark(), frame: bytes(model.get('_frame')) })
  const dress = () => say({ kind: 'theme', dark: isDark() })
  const move = () => say({ kind: 'time', time: model.get('time') })
  const hear = ({ source, data }) => {
    if (source !== frame.contentWindow) return
    if (data.kind === 'ready') {
      show()
      if (model.get('time') !== null) move()
    } else if (data.kind === 'time') {
      model.set('time', data.time)
      model.save_changes()
    }
  }
  const system = matchMedia('(prefers-color-scheme: dark)')
  const notebook = new MutationObserver(dress)
  addEventListener('message', hear)
  system.addEventListener('change', dress)
  notebook.observe(document.body, { attributeFilter: ['class', 'data-jp-theme-light'] })
  model.on('change:_shown', show)
  model.on('change:time', move)
  frame.srcdoc = model.get('_page')
  el.append(frame)
  return () => {
    removeEventListener('message', hear)
    system.removeEventListener('change', dress)
    notebook.disconnect()
    model.off('change:_shown', show)
    model.off('change:time', move)
  }
}

export default { render }
