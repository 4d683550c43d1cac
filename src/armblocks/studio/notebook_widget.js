// The studio's views in a notebook, as a widget of anywidget (https://anywidget.dev). An iframe separates the
// styles of the views from those of the notebook. The widget contains all scripts and styles of the iframe.

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
  const send = (message) => frame.contentWindow?.postMessage(message, '*')
  const sendContent = () =>
    send({ ...model.get('_shown'), kind: 'show', dark: isDark(), frame: bytes(model.get('_frame')) })
  const sendTheme = () => send({ kind: 'theme', dark: isDark() })
  const sendTime = () => send({ kind: 'time', time: model.get('time') })
  const sendPoses = () => model.get('_poses') && send({ kind: 'poses', ...model.get('_poses') })
  const sendLive = () => send({ kind: 'live', live: model.get('_live') })
  const receive = ({ source, data }) => {
    if (source !== frame.contentWindow) return
    if (data.kind === 'ready') {
      sendContent()
      sendPoses()
      if (model.get('time') !== null) sendTime()
    } else if (data.kind === 'joints') {
      model.set('joints', data.q)
      model.save_changes()
    } else if (data.kind === 'time') {
      model.set('time', data.time)
      model.save_changes()
    }
  }
  const systemTheme = matchMedia('(prefers-color-scheme: dark)')
  const themeObserver = new MutationObserver(sendTheme)
  addEventListener('message', receive)
  systemTheme.addEventListener('change', sendTheme)
  themeObserver.observe(document.body, { attributeFilter: ['class', 'data-jp-theme-light'] })
  model.on('change:_shown', sendContent)
  model.on('change:time', sendTime)
  model.on('change:_poses', sendPoses)
  model.on('change:_live', sendLive)
  frame.srcdoc = model.get('_page')
  el.append(frame)
  return () => {
    removeEventListener('message', receive)
    systemTheme.removeEventListener('change', sendTheme)
    themeObserver.disconnect()
    model.off('change:_shown', sendContent)
    model.off('change:time', sendTime)
    model.off('change:_poses', sendPoses)
    model.off('change:_live', sendLive)
  }
}

export default { render }
